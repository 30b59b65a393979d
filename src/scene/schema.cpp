// SPDX-License-Identifier: MIT
// One definition a table; edits and nodes are one alternative a shape, each with that shape's own keys.

#include "scene/schema.h"

#include "scene/format.h"
#include "scene/heights.h"

#include <nlohmann/json.hpp>

#include <charconv>
#include <set>

namespace kiln::scene {

namespace {

using Json = nlohmann::ordered_json;

Json reference(std::string_view name) { return {{"$ref", "#/$defs/" + std::string(name)}}; }

// Shortest decimal of a float, as a double: 0.1f is written 0.1.
double tidy(float v) {
    char buffer[40];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, v).ptr;
    double out = 0;
    std::from_chars(buffer, end, out);
    return out;
}

double leading_number(std::string_view text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '[' || text.front() == '(')) text.remove_prefix(1);
    double out = 0;
    std::from_chars(text.data(), text.data() + text.size(), out);
    return out;
}

// The ranges that sdf::out_of_range reads.
Json number_of(const sdf::FieldRow& row) {
    Json out;
    std::string_view range = row.range;
    if (range == "axis") return {{"enum", kAxisNames}};
    if (range == "flag") return {{"type", "boolean"}};
    out["type"] = "number";
    if (range.starts_with("integer ")) {
        out["type"] = "integer";
        range.remove_prefix(8);
    }
    if (range == "> 0") {
        out["exclusiveMinimum"] = 0;
    } else if (range == ">= 0") {
        out["minimum"] = 0;
    } else if (range.front() == '[' || range.front() == '(') {
        const size_t comma = range.find(',');
        out[range.front() == '[' ? "minimum" : "exclusiveMinimum"] = leading_number(range);
        out[range.back() == ']' ? "maximum" : "exclusiveMaximum"] = leading_number(range.substr(comma + 1));
    }
    const double limit = row.unit == "m" ? double(kFarthest) : 1e12;
    if (!out.contains("maximum") && !out.contains("exclusiveMaximum")) out["maximum"] = limit;
    if (!out.contains("minimum") && !out.contains("exclusiveMinimum")) out["minimum"] = -limit;
    return out;
}

Json numbers_of(const sdf::FieldRow& row) {
    const Json one = number_of(row);
    Json out = one;
    if (row.arity > 1) {
        out = {{"type", "array"}, {"items", one}, {"minItems", row.arity}, {"maxItems", row.arity}};
        if (row.arity == 2) out = {{"anyOf", {one, out}}};
    }
    std::string doc(row.doc);
    if (row.unit != "1") doc += " (" + std::string(row.unit) + ")";
    out["description"] = doc;
    if (row.range == "axis") {
        out["default"] = kAxisNames[size_t(row.defaults[0])];
    } else if (row.range == "flag") {
        out["default"] = row.defaults[0] != 0;
    } else if (row.arity == 1) {
        out["default"] = tidy(row.defaults[0]);
    } else {
        Json values = Json::array();
        for (int k = 0; k < row.arity; ++k) values.push_back(tidy(row.defaults[size_t(k)]));
        out["default"] = values;
    }
    return out;
}

Json value_of(const KeyRow& row) {
    Json out;
    switch (row.type) {
    case KeyType::Numbers:
        return numbers_of(row.numbers);
    case KeyType::Scale: {
        const Json one = {{"type", "number"}, {"minimum", tidy(kSmallestScale)}, {"maximum", tidy(kLargestScale)}};
        out = {{"anyOf", {one, {{"type", "array"}, {"items", one}, {"minItems", 3}, {"maxItems", 3}}}}};
        break;
    }
    case KeyType::Rotation:
        out = {{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 4}, {"maxItems", 4}};
        break;
    case KeyType::Bool:
        out = {{"type", "boolean"}};
        break;
    case KeyType::Text:
        out = {{"type", "string"}};
        break;
    case KeyType::TextList:
        out = {{"type", "array"}, {"items", {{"type", "string"}}}, {"minItems", 1}};
        break;
    case KeyType::Choice:
        out = {{"enum", row.choices}};
        break;
    case KeyType::Object:
        out = reference(row.table->name);
        break;
    case KeyType::List:
        out = {{"type", "array"}};
        if (row.table) out["items"] = reference(row.table->name);
        break;
    case KeyType::Map:
        out = {{"type", "object"},
               {"additionalProperties", reference(row.table->name)},
               {"propertyNames", {{"minLength", 1}}}};
        break;
    case KeyType::Pinned:
        out = {{"anyOf",
                {{{"enum", {"top", "corners"}}},
                 {{"type", "array"},
                  {"items",
                   {{"type", "array"},
                    {"items", {{"type", "integer"}, {"minimum", 0}}},
                    {"minItems", 2},
                    {"maxItems", 2}}}}}}};
        break;
    case KeyType::Node:
        break;  // written by nodes_of
    }
    out["description"] = row.doc;
    return out;
}

Json table_of(const Table& table) {
    Json out = {{"description", table.doc}, {"type", "object"}};
    Json required = Json::array();
    for (const KeyRow& row : table.rows) {
        out["properties"][std::string(row.name)] = value_of(row);
        if (row.required) required.push_back(row.name);
    }
    if (!required.empty()) out["required"] = required;
    out["additionalProperties"] = false;
    return out;
}

Json lights_of() {
    Json any = Json::array();
    for (size_t kind = 0; kind < kLightNames.size(); ++kind) {
        Json one = {{"type", "object"}};
        for (const KeyRow& row : kLightTable.rows)
            if (row.kinds & (1u << kind)) one["properties"][std::string(row.name)] = value_of(row);
        one["properties"]["type"] = {{"const", kLightNames[kind]}};
        one["required"] = {"type"};
        one["additionalProperties"] = false;
        any.push_back(one);
    }
    return {{"description", kLightTable.doc}, {"oneOf", any}};
}

Json domain_of() {
    Json any = Json::array();
    for (const sdf::KindRow& row : sdf::warp_rows()) {
        Json one = {{"description", row.doc}, {"type", "object"}};
        one["properties"]["warp"] = {{"const", row.name}};
        for (const sdf::FieldRow& field : row.fields())
            if (field.range != "internal") one["properties"][std::string(field.name)] = numbers_of(field);
        one["required"] = {"warp"};
        one["additionalProperties"] = false;
        any.push_back(one);
    }
    return {{"description", "Warps, from the bare shape outwards"}, {"type", "array"}, {"items", {{"oneOf", any}}}};
}

// Edits and tree nodes: an alternative for each shape, one for objects, and for nodes one with children.
Json nodes_of(const Table& table) {
    const bool tree = &table == &kNodeTable;
    const std::set<std::string_view> fold_keys{"op", "blend_radius", "material_blend_radius"};
    const auto common = [&](bool folds) {
        Json properties = Json::object();
        for (const KeyRow& row : table.rows) {
            if (row.name == "shape" || row.name == "object" || row.name == "children") continue;
            if (tree && !folds && fold_keys.contains(row.name)) continue;
            properties[std::string(row.name)] = row.name == "domain" ? reference("domain") : value_of(row);
        }
        return properties;
    };
    Json any = Json::array();
    const auto add = [&](std::string_view doc, Json properties, Json required) {
        any.push_back({{"description", doc},
                       {"type", "object"},
                       {"properties", std::move(properties)},
                       {"required", std::move(required)},
                       {"additionalProperties", false}});
    };
    for (const sdf::KindRow& row : sdf::shape_rows()) {
        Json properties = {{"shape", {{"const", row.name}}}};
        Json required = {"shape"};
        for (const sdf::FieldRow& field : row.fields())
            if (field.range != "internal") properties[std::string(field.name)] = numbers_of(field);
        if (row.how == sdf::KindRow::Sampled) {
            properties["file"] = {
                {"type", "string"},
                {"description", std::string(resource_of(uint16_t(&row - sdf::shape_rows().data())).what) +
                                    ", relative to the scene file"}};
            required.push_back("file");
        }
        if (row.how == sdf::KindRow::Formula) {
            properties["expression"] = {{"type", "string"}, {"description", "the formula; or `file`"}};
            properties["file"] = {
                {"type", "string"},
                {"description", ".vm model or .glsl function, relative to the scene file; or `expression`"}};
        }
        properties.update(common(false));
        add(row.doc, std::move(properties), std::move(required));
    }
    Json object = {{"object", {{"type", "string"}, {"description", "name of an object"}}}};
    object.update(common(false));
    add("An object placed by reference", std::move(object), {"object"});
    if (tree) {
        Json fold = common(true);
        fold["children"] = {{"type", "array"}, {"items", reference(table.name)}, {"minItems", 1}};
        add("Children folded from left to right", std::move(fold), {"children"});
    }
    return {{"description", table.doc}, {"oneOf", any}};
}

void define(const Table& table, Json& definitions) {
    const std::string name(table.name);
    if (definitions.contains(name)) return;
    definitions[name] = nullptr;  // holds the place, and ends cycles
    for (const KeyRow& row : table.rows)
        if (row.table) define(*row.table, definitions);
    const bool node = &table == &kEditTable || &table == &kNodeTable;
    definitions[name] = node ? nodes_of(table) : &table == &kLightTable ? lights_of() : table_of(table);
}

}  // namespace

std::string schema_json() {
    Json out = {{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", "Kiln scene"}};
    Json definitions = Json::object();
    definitions["domain"] = domain_of();
    for (const KeyRow& row : kSceneTable.rows)
        if (row.table) define(*row.table, definitions);
    Json scene = table_of(kSceneTable);
    out.update(scene);
    out["$defs"] = definitions;
    return out.dump(2) + "\n";
}

}  // namespace kiln::scene
