// SPDX-License-Identifier: MIT
// The line-per-operation form that public models of the field are kept in: `_2 const 8.13`, `_3 mul _1 _2`. A line names one value
// by an operation on values named before; the last line is the model's value.

#include "sdf/expression_build.h"

#include "base/format.h"
#include "base/suggest.h"

#include <charconv>
#include <cmath>

namespace kiln::sdf {

namespace {

struct Operation {
    std::string_view name;
    Fn fn;
};
constexpr Operation kOperations[] = {
    {"neg", Fn::Negate},  {"abs", Fn::Abs}, {"sqrt", Fn::Sqrt}, {"square", Fn::Square}, {"floor", Fn::Floor},
    {"sin", Fn::Sin},     {"cos", Fn::Cos}, {"exp", Fn::Exp},   {"ln", Fn::Log},        {"add", Fn::Add},
    {"sub", Fn::Sub},     {"mul", Fn::Mul}, {"div", Fn::Div},   {"min", Fn::Min},       {"max", Fn::Max},
    {"atan2", Fn::Atan2}, {"mod", Fn::Mod},
};
constexpr std::string_view kOthers[] = {"const", "var-x", "var-y", "var-z", "ceil",  "round",
                                        "tan",   "asin",  "acos",  "atan",  "recip", "pow"};

struct Word {
    std::string_view text;
    size_t place = 0;
};

}  // namespace

Result<Formula> read_vm(std::string_view text) {
    Builder build;
    std::unordered_map<std::string_view, uint32_t> names;
    uint32_t last = 0;
    bool any = false;
    size_t at = 0, line = 0;
    while (at < text.size()) {
        const size_t begin = at;
        size_t end = text.find('\n', at);
        if (end == std::string_view::npos) end = text.size();
        at = end + 1;
        ++line;
        std::string_view rest = text.substr(begin, end - begin);
        if (const size_t comment = rest.find('#'); comment != std::string_view::npos) rest = rest.substr(0, comment);
        Word words[5];
        size_t count = 0;
        for (size_t i = 0; i < rest.size() && count < 5;) {
            const auto blank = [&](char c) { return c == ' ' || c == '\t' || c == '\r'; };
            while (i < rest.size() && blank(rest[i])) ++i;
            const size_t from = i;
            while (i < rest.size() && !blank(rest[i])) ++i;
            if (i > from) words[count++] = {rest.substr(from, i - from), from};
        }
        if (count == 0) continue;
        const auto fail = [&](size_t word, std::string what) {
            return Error{formatted("{}:{}: ", line, (word < count ? words[word].place : rest.size()) + 1) + what,
                         ErrorKind::Input};
        };
        const auto shown = [](std::string_view word) { return word.substr(0, 40); };
        if (count == 1)
            return fail(1, formatted("\"{}\" has no operation; write for example \"_1 var-x\"", shown(words[0].text)));
        const std::string_view name = words[0].text, op = words[1].text;
        if (names.contains(name)) return fail(0, formatted("\"{}\" is named twice; choose another name", shown(name)));
        const auto takes = [&](size_t n) { return count == 2 + n; };
        const auto wrong_count = [&](size_t n) {
            return fail(std::min(count, 2 + n),
                        formatted("{} takes {} operand{}, here are {}{}", op, n, n == 1 ? "" : "s",
                                  count == 5 ? "more than " : "", count == 5 ? 2 : count - 2));
        };
        uint32_t in[2] = {0, 0};
        const auto look_up = [&](size_t n) -> std::optional<Error> {
            for (size_t i = 0; i < n; ++i) {
                const auto found = names.find(words[2 + i].text);
                if (found == names.end())
                    return fail(2 + i, formatted("there is no value \"{}\" above; name one of the lines before",
                                                 shown(words[2 + i].text)));
                in[i] = found->second;
            }
            return std::nullopt;
        };
        uint32_t node = 0;
        bool known = false;
        for (const Operation& o : kOperations) {
            if (o.name != op) continue;
            known = true;
            const auto n = size_t(operands(o.fn));
            if (!takes(n)) return wrong_count(n);
            if (auto error = look_up(n)) return std::move(*error);
            node = n == 1 ? build.unary(o.fn, in[0]) : build.binary(o.fn, in[0], in[1]);
        }
        if (known) {
            // done
        } else if (op == "const") {
            if (!takes(1)) return wrong_count(1);
            double value = 0;
            const std::string_view digits = words[2].text;
            const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
            if (error != std::errc{} || stop != digits.data() + digits.size() ||
                !(std::fabs(value) <= kLargestConstant))
                return fail(2, formatted("\"{}\" is no number below 1e30; write for example 2.95", shown(digits)));
            node = build.constant(value);
        } else if (op == "var-x" || op == "var-y" || op == "var-z") {
            if (!takes(0)) return wrong_count(0);
            node = build.variable(op == "var-x" ? Fn::X : op == "var-y" ? Fn::Y : Fn::Z);
        } else if (op == "pow") {
            if (!takes(2)) return wrong_count(2);
            if (auto error = look_up(2)) return std::move(*error);
            node = build.power(in[0], in[1]);
        } else if (op == "ceil" || op == "round" || op == "tan" || op == "asin" || op == "acos" || op == "atan" ||
                   op == "recip") {
            if (!takes(1)) return wrong_count(1);
            if (auto error = look_up(1)) return std::move(*error);
            node = op == "ceil"    ? build.ceil(in[0])
                   : op == "round" ? build.round(in[0])
                   : op == "tan"   ? build.tan(in[0])
                   : op == "asin"  ? build.asin(in[0])
                   : op == "acos"  ? build.acos(in[0])
                   : op == "atan"  ? build.binary(Fn::Atan2, in[0], build.constant(1))
                                   : build.binary(Fn::Div, build.constant(1), in[0]);
        } else {
            std::vector<std::string_view> all(std::begin(kOthers), std::end(kOthers));
            for (const Operation& o : kOperations) all.push_back(o.name);
            std::string mend = "use one of";
            for (const std::string_view n : all) mend += " " + std::string(n);
            return fail(1, formatted("there is no operation \"{}\"; {}", shown(op), suggestion(op, all, mend)));
        }
        if (build.full()) return fail(0, formatted("more than {} operations; use a smaller model", kMaxFormulaNodes));
        if (build.not_finite())
            return fail(0, "this comes to no finite number (a division by 0?); change its constants");
        names.emplace(name, node);
        last = node;
        any = true;
    }
    if (!any) return Error{"1:1: no operation in the model; write lines such as \"_1 var-x\"", ErrorKind::Input};
    return build.finish(last);
}

}  // namespace kiln::sdf
