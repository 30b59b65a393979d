// SPDX-License-Identifier: MIT
#include "sdf/expression_glsl_tokens.h"

#include "sdf/expression_build.h"

#include "base/format.h"

#include <charconv>
#include <cmath>

namespace kiln::sdf::glsl {

bool Tokens::fail(size_t place, std::string what) {
    error_ = place_in(text_, place) + ": " + std::move(what);
    return false;
}

bool Tokens::split() {
    static constexpr std::string_view kPairs[] = {"==", "!=", "<=", ">=", "&&", "||", "^^",
                                                  "++", "--", "+=", "-=", "*=", "/="};
    const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
    const auto digit = [](char c) { return c >= '0' && c <= '9'; };
    size_t i = 0;
    const size_t n = text_.size();
    while (i < n) {
        const char c = text_[i];
        const std::string_view two = text_.substr(i, 2);
        if (c == ' ' || c == '\t' || c == '\n' || c == '\r') {
            ++i;
        } else if (two == "//") {
            while (i < n && text_[i] != '\n') ++i;
        } else if (two == "/*") {
            const size_t end = text_.find("*/", i + 2);
            if (end == std::string_view::npos) return fail(i, "this comment has no end; add */");
            i = end + 2;
        } else if (letter(c)) {
            const size_t from = i;
            while (i < n && (letter(text_[i]) || digit(text_[i]))) ++i;
            tokens_.push_back({Token::Kind::Name, text_.substr(from, i - from), from});
        } else if (digit(c) || (c == '.' && i + 1 < n && digit(text_[i + 1]))) {
            const size_t from = i;
            double ignored = 0;
            const auto [rest, error] = std::from_chars(text_.data() + i, text_.data() + n, ignored);
            i = size_t(rest - text_.data());
            if (i < n && (text_[i] == 'f' || text_[i] == 'F' || text_[i] == 'u')) ++i;
            if (error != std::errc{} || !(std::fabs(ignored) <= kLargestConstant))
                return fail(from, "a number out of range; use one below 1e30");
            if (i < n && (letter(text_[i]) || digit(text_[i])))
                return fail(from, "not a number; use one such as 1, 0.5 or 2e-3");
            tokens_.push_back({Token::Kind::Number, text_.substr(from, i - from), from});
        } else {
            size_t length = 1;
            for (const std::string_view pair : kPairs)
                if (two == pair) length = 2;
            if (length == 1 && std::string_view("+-*/=<>!?:;,.(){}[]&|").find(c) == std::string_view::npos) {
                if (c == '#') return fail(i, "# lines are not read; write constants as const float NAME = VALUE;");
                while (i + length < n && (uint8_t(text_[i + length]) & 0xc0) == 0x80) ++length;
                return fail(i, formatted("\"{}\" is not of this language; take it out", text_.substr(i, length)));
            }
            tokens_.push_back({Token::Kind::Symbol, text_.substr(i, length), i});
            i += length;
        }
    }
    tokens_.push_back({Token::Kind::End, {}, n});
    return true;
}

bool Tokens::need(std::string_view text) {
    if (take(text)) return true;
    return fail_here(formatted("\"{}\" is missing before {}; add it", text, seen(now())));
}

bool Tokens::name(std::string_view& out) {
    if (now().kind != Token::Kind::Name) return fail_here(formatted("a name is missing before {}", seen(now())));
    out = now().text;
    ++at_;
    return true;
}

bool Tokens::skip_brackets() {
    const size_t open = at_;
    for (int depth = 0;; ++at_) {
        if (now().kind == Token::Kind::End) return fail(tokens_[open].place, "this bracket is not closed; close it");
        if (is("(") || is("{") || is("[")) ++depth;
        if ((is(")") || is("}") || is("]")) && --depth == 0) break;
    }
    ++at_;
    return true;
}

bool Tokens::skip_statement(int nested) {
    if (nested > kMostNested) return fail_here("nested too deeply; write it flatter");
    if (is("{")) return skip_brackets();
    if (take("if")) {
        if (!skip_brackets() || !skip_statement(nested + 1)) return false;
        return !take("else") || skip_statement(nested + 1);
    }
    if (take("for")) return skip_brackets() && skip_statement(nested + 1);
    while (!is(";")) {
        if (is("(") || is("[")) {
            if (!skip_brackets()) return false;
            continue;
        }
        if (now().kind == Token::Kind::End || is("}")) return need(";");
        ++at_;
    }
    ++at_;
    return true;
}

}  // namespace kiln::sdf::glsl
