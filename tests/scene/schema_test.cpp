// SPDX-License-Identifier: MIT
// The schema against the reader, by a small checker of the words that the schema uses.
#include "scene/schema.h"

#include "scene/bundled.h"
#include "scene_text.h"
#include "rounds.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace kiln::scene {
namespace {

using Json = nlohmann::json;

class Checker {
public:
    explicit Checker(const std::string& schema) : root_(Json::parse(schema)) {}
    bool accepts(const std::string& text) const { return fits(Json::parse(text), root_); }

private:
    bool fits(const Json& v, const Json& s) const {
        if (s.contains("$ref")) {
            const std::string name = s["$ref"].get<std::string>().substr(std::string("#/$defs/").size());
            return fits(v, root_["$defs"].at(name));
        }
        if (s.contains("type")) {
            const std::string t = s["type"];
            const bool ok = t == "object"    ? v.is_object()
                            : t == "array"   ? v.is_array()
                            : t == "string"  ? v.is_string()
                            : t == "boolean" ? v.is_boolean()
                            : t == "integer" ? v.is_number() && v.get<double>() == std::floor(v.get<double>())
                                             : t == "number" && v.is_number();
            if (!ok) return false;
        }
        if (s.contains("const") && s["const"] != v) return false;
        if (s.contains("enum") && std::find(s["enum"].begin(), s["enum"].end(), v) == s["enum"].end()) return false;
        if (v.is_number()) {
            const double x = v;
            if (s.contains("minimum") && x < s["minimum"].get<double>()) return false;
            if (s.contains("maximum") && x > s["maximum"].get<double>()) return false;
            if (s.contains("exclusiveMinimum") && x <= s["exclusiveMinimum"].get<double>()) return false;
            if (s.contains("exclusiveMaximum") && x >= s["exclusiveMaximum"].get<double>()) return false;
        }
        if (v.is_array()) {
            if (s.contains("minItems") && v.size() < s["minItems"].get<size_t>()) return false;
            if (s.contains("maxItems") && v.size() > s["maxItems"].get<size_t>()) return false;
            if (s.contains("items"))
                for (const Json& item : v)
                    if (!fits(item, s["items"])) return false;
        }
        if (v.is_object()) {
            if (s.contains("required"))
                for (const Json& key : s["required"])
                    if (!v.contains(key.get<std::string>())) return false;
            for (const auto& [key, value] : v.items()) {
                if (s.contains("properties") && s["properties"].contains(key)) {
                    if (!fits(value, s["properties"][key])) return false;
                } else if (s.contains("additionalProperties")) {
                    const Json& more = s["additionalProperties"];
                    if (more.is_boolean() ? !more.get<bool>() : !fits(value, more)) return false;
                }
            }
        }
        const auto count = [&](const Json& list) {
            size_t n = 0;
            for (const Json& one : list) n += fits(v, one);
            return n;
        };
        if (s.contains("oneOf") && count(s["oneOf"]) != 1) return false;
        return !s.contains("anyOf") || count(s["anyOf"]) >= 1;
    }

    Json root_;
};

TEST(Schema, AcceptsTheBundledScenes) {
    const Checker checker(schema_json());
    for (const BundledScene& scene : bundled_files()) {
        if (scene.json.size() > size_t(rounds(1 << 22))) continue;  // the one of megabytes, under a sanitizer
        EXPECT_TRUE(checker.accepts(std::string(scene.json))) << scene.name;
    }
}

// Where a schema can tell, reader and schema are of one mind.
TEST(Schema, AgreesWithTheReader) {
    const Checker checker(schema_json());
    const std::string more = "\"materials\": {\"m\": {}}, \"objects\": {\"o\": {\"children\": [{\"shape\": \"box\"}]}}";
    const std::pair<const char*, bool> cases[] = {
        {"{\"shape\": \"sphere\"}", true},
        {"{\"shape\": \"sphere\", \"radius\": 2, \"material\": \"m\", \"scale\": 2}", true},
        {"{\"shape\": \"sphere\", \"scale\": [1, 2, 3], \"domain\": [{\"warp\": \"mirror\", \"axis\": \"y\"}]}", true},
        {"{\"object\": \"o\", \"op\": \"subtract\"}", true},
        {"{\"shape\": \"plane\"}", true},
        {"{\"shape\": \"prism\", \"sides\": 7}", true},
        {"{\"shape\": \"sphere\", \"radius\": 0}", false},
        {"{\"shape\": \"sphere\", \"radius\": \"1\"}", false},
        {"{\"shape\": \"sphere\", \"radius\": 1e12}", false},
        {"{\"shape\": \"sphere\", \"half_extents\": [1, 1, 1]}", false},
        {"{\"shape\": \"blob\"}", false},
        {"{\"shape\": \"sphere\", \"object\": \"o\"}", false},
        {"{\"children\": [{\"shape\": \"sphere\"}]}", false},
        {"{\"shape\": \"prism\", \"sides\": 2}", false},
        {"{\"shape\": \"prism\", \"sides\": 7.5}", false},
        {"{\"shape\": \"sphere\", \"op\": \"add\"}", false},
        {"{\"shape\": \"sphere\", \"scale\": [1, 2]}", false},
        {"{\"shape\": \"sphere\", \"domain\": [{\"warp\": \"mirror\", \"axis\": 1}]}", false},
        {"{\"shape\": \"heightfield\"}", false},
        {"{\"shape\": \"mesh\", \"resolution\": 64}", false},
        {"{\"shape\": \"mesh\", \"file\": \"a.obj\", \"closed\": 1}", false},
        {"{\"shape\": \"mesh\", \"file\": \"a.obj\", \"resolution\": 600}", false},
        {"{}", false},
    };
    for (const auto& [edit, good] : cases) {
        const std::string text = scene_with(edit, more);
        EXPECT_EQ(checker.accepts(text), good) << edit;
        EXPECT_EQ(fault_of(text).empty(), good) << edit << fault_of(text);
    }
    for (const char* node : {"{\"shape\": \"box\", \"op\": \"union\"}", "{\"children\": []}"}) {
        const std::string text = "{\"format\": 1, \"objects\": {\"o\": " + std::string(node) + "}}";
        EXPECT_FALSE(checker.accepts(text)) << node;
        EXPECT_NE(fault_of(text), "") << node;
    }
}

}  // namespace
}  // namespace kiln::scene
