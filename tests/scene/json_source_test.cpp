// SPDX-License-Identifier: MIT
#include "scene/json_source.h"
#include "rounds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>

namespace kiln::scene {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

std::string error_of(const std::string& text) {
    auto d = JsonDocument::parse(text, "f.json");
    return d ? "no error" : d.error().message;
}

struct BadText {
    const char* text;
    const char* starts;
    const char* says;
};

class EachBadText : public testing::TestWithParam<BadText> {};

TEST_P(EachBadText, IsRefusedWithItsPlace) {
    const std::string message = error_of(GetParam().text);
    EXPECT_THAT(message, StartsWith(GetParam().starts)) << GetParam().text;
    EXPECT_THAT(message, HasSubstr(GetParam().says)) << GetParam().text;
    EXPECT_EQ(message.find('\n'), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    Json, EachBadText,
    testing::Values(
        BadText{"", "f.json:1:1: ", "empty"}, BadText{"  \n ", "f.json:2:2: ", "empty"},
        BadText{"{\"a\": 1,\n}", "f.json:1:8: ", "comma"}, BadText{"[1, 2", "f.json:1:6: ", "file ends here"},
        BadText{"{\"a\": NaN}", "f.json:1:7: ", "finite"}, BadText{"{\"a\": -Infinity}", "f.json:1:7: ", "finite"},
        BadText{"{\"a\": 1e999}", "f.json:1:7: ", "too large"}, BadText{"[01]", "f.json:1:2: ", "leading 0"},
        BadText{"[1.]", "f.json:1:2: ", "digit"}, BadText{"[.5]", "f.json:1:2: ", "expected a value"},
        BadText{"[1e+]", "f.json:1:2: ", "digits after"}, BadText{"{\"a\": 1 // x\n}", "f.json:1:9: ", "no comments"},
        BadText{"{'a': 1}", "f.json:1:2: ", "double quotes"}, BadText{"{\"a\" 1}", "f.json:1:6: ", "':'"},
        BadText{"{\"a\": 1, \"a\": 2}", "f.json:1:10: a: ", "twice"},
        BadText{"{\"b\": [], \"c\": {\"a\": 1, \"a\": 2}}", "f.json:1:25: c.a: ", "twice"},
        BadText{"[1] 2", "f.json:1:5: ", "after the end"}, BadText{"[\"a\xff\"]", "f.json:1:4: ", "UTF-8"},
        BadText{"[\"\xc0\x80\"]", "f.json:1:3: ", "UTF-8"}, BadText{"[\"\xed\xa0\x80\"]", "f.json:1:3: ", "UTF-8"},
        BadText{"[\"a\nb\"]", "f.json:1:2: ", "closing quote"}, BadText{"[\"\\q\"]", "f.json:1:3: ", "escape"},
        BadText{"[\"\\u12\"]", "f.json:1:3: ", "hexadecimal"}, BadText{"[\"\\ud800\"]", "f.json:1:3: ", "surrogate"},
        BadText{"[\"é\", x]", "f.json:1:7: ", "found 'x'"}, BadText{"[\x01]", "f.json:1:2: ", "unreadable"}));

TEST(JsonDocument, RemembersOrderPlacesAndPaths) {
    auto d = JsonDocument::parse("{\n  \"b\": 1,\n  \"a\": [true, {\"x y\": null}]\n}", "f");
    ASSERT_TRUE(d);
    const JsonIndex b = d->first(0);
    EXPECT_EQ(d->key(b), "b");
    const JsonIndex a = d->next(b);
    EXPECT_EQ(d->key(a), "a");
    EXPECT_EQ(d->count(a), 2u);
    const JsonIndex inner = d->first(d->next(d->first(a)));
    EXPECT_EQ(d->path(inner), "a[1].x y");
    EXPECT_EQ(d->place(inner).line, 3u);
    EXPECT_EQ(d->place(inner).column, 23u);
    EXPECT_EQ(d->error(inner, "m").message, "f:3:23: a[1].x y: m");
    EXPECT_EQ(d->error_at_key(inner, "m").message, "f:3:16: a[1].x y: m");
}

TEST(JsonDocument, ReadsEscapesAndAnOrderMark) {
    auto d = JsonDocument::parse("\xEF\xBB\xBF[\"\\u00e9\\n\\ud83d\\ude00\", \"plain\"]", "f");
    ASSERT_TRUE(d);
    EXPECT_EQ(d->text(1), "é\n😀");
    EXPECT_EQ(d->text(2), "plain");
}

TEST(JsonDocument, UnderflowIsZeroAndOverflowOfFloatIsInfinity) {
    auto d = JsonDocument::parse("[1e-999, 1e39, -1e39, 0.1]", "f");
    ASSERT_TRUE(d);
    EXPECT_EQ(d->number(1), 0.0);
    EXPECT_TRUE(std::isinf(d->number_as_float(2)));
    EXPECT_LT(d->number_as_float(3), 0);
    EXPECT_EQ(d->number_as_float(4), 0.1f);
}

TEST(JsonDocument, DepthNeedsNoStack) {
    constexpr size_t kDeep = rounds(1000000);
    std::string text(kDeep, '[');
    text.append(kDeep, ']');
    auto d = JsonDocument::parse(text, "f");
    ASSERT_TRUE(d);
    EXPECT_EQ(d->next(0), kDeep);
    const std::string printed = d->print();
    auto again = JsonDocument::parse(printed, "f");
    ASSERT_TRUE(again);
    EXPECT_EQ(again->print(), printed);
    EXPECT_LT(d->path(JsonIndex(kDeep - 1)).size(), 200u);
    EXPECT_THAT(error_of(std::string(kDeep, '[')), HasSubstr("file ends here"));
}

RC_GTEST_PROP(JsonDocument, EveryFiniteFloatRoundTripsToItsBits, (uint32_t bits)) {
    const float v = std::bit_cast<float>(bits);
    RC_PRE(std::isfinite(v));
    JsonDocument out;
    out.open(JsonType::Array);
    out.add_float(v);
    out.close();
    auto in = JsonDocument::parse(out.print(), "f");
    RC_ASSERT(bool(in));
    RC_ASSERT(in->number_as_float(1) == v);
}

RC_GTEST_PROP(JsonDocument, AnyTextRoundTripsThroughQuotes, (const std::string& raw)) {
    std::string text;
    for (const char c : raw) text += char(c & 0x7f);
    JsonDocument out;
    out.open(JsonType::Object);
    out.add_text(text, text);
    out.close();
    auto in = JsonDocument::parse(out.print(), "f");
    RC_ASSERT(bool(in));
    RC_ASSERT(in->text(1) == text);
    RC_ASSERT(in->key(1) == text);
}

TEST(JsonDocument, ErrorsAreOneLineWhateverKeysHold) {
    auto d = JsonDocument::parse("{\"a\\nb\": 1}", "f");
    ASSERT_TRUE(d);
    EXPECT_EQ(d->error(1, "wrong\r\n").message, "f:1:10: a\\u000ab: wrong\\u000d\\u000a");
}

TEST(JsonPrint, FitsOnALineOrBreaks) {
    auto d = JsonDocument::parse("{\"a\":[1,2.50,\"x\"],\"e\":[],\"o\":{},\"n\":{\"k\":-0.0}}", "f");
    ASSERT_TRUE(d);
    EXPECT_EQ(d->print(), "{\n  \"a\": [1, 2.5, \"x\"],\n  \"e\": [],\n  \"o\": {},\n  \"n\": { \"k\": 0 }\n}\n");
}

}  // namespace
}  // namespace kiln::scene
