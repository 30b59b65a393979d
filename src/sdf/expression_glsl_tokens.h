// SPDX-License-Identifier: MIT
// GLSL text as tokens, and a place among them: what reading and walking them again begins with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kiln::sdf::glsl {

inline constexpr int kMostNested = 400;

struct Token {
    enum class Kind : uint8_t { Name, Number, Symbol, End };
    Kind kind = Kind::End;
    std::string_view text;
    size_t place = 0;
};

class Tokens {
protected:
    explicit Tokens(std::string_view text) : text_(text) {}

    // Said of a place in the text; always false.
    bool fail(size_t place, std::string what);
    bool fail_here(std::string what) { return fail(now().place, std::move(what)); }
    static std::string seen(const Token& t) {
        return t.kind == Token::Kind::End ? "the end" : "\"" + std::string(t.text.substr(0, 40)) + "\"";
    }
    bool split();
    const Token& now() const { return tokens_[at_]; }
    bool is(std::string_view text) const { return now().kind != Token::Kind::End && now().text == text; }
    bool take(std::string_view text) {
        if (!is(text)) return false;
        ++at_;
        return true;
    }
    bool need(std::string_view text);
    bool name(std::string_view& out);
    // Past the bracket that closes the one here.
    bool skip_brackets();
    bool skip_statement(int nested = 0);
    void skip_precision() {
        while (is("highp") || is("mediump") || is("lowp")) ++at_;
    }

    std::string_view text_;
    std::vector<Token> tokens_;
    size_t at_ = 0;
    std::string error_;
};

}  // namespace kiln::sdf::glsl
