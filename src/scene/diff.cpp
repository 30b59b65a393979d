// SPDX-License-Identifier: MIT
// How two scenes differ: edits by id, materials, objects and cameras by name, everything else by its key. Both scenes are compared as they
// would be written from nothing, so neither the order of keys nor a default that is spelled out counts.

#include "scene/format.h"
#include "scene/world_impl.h"

#include "base/format.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <unordered_map>

namespace kiln {

namespace {

using scene::JsonDocument;
using scene::JsonIndex;
using scene::JsonType;
using Report = nlohmann::ordered_json;

std::string text_of(const JsonDocument& doc, JsonIndex i) {
    JsonDocument one;
    one.add_copy(doc, i);
    return one.line();
}

// A thing with a name in one of the scenes.
struct Item {
    std::string name;
    JsonIndex at;
};

// A section's members by name, by "id", or by their number where they have neither; of a section that is not there, none.
std::vector<Item> items_of(const JsonDocument& doc, std::string_view section) {
    std::vector<Item> out;
    const auto at = doc.find(0, section);
    if (!at) return out;
    for (JsonIndex c = doc.first(*at); c < doc.next(*at); c = doc.next(c)) {
        const auto id = doc.find(c, "id");
        out.push_back({doc.is(*at, JsonType::Object) ? std::string(doc.key(c))
                       : id                          ? std::string(doc.text(*id))
                                                     : formatted("#{}", out.size() + 1),
                       c});
    }
    return out;
}

// Whether a value says what leaving its key out means, by the format's tables.
bool is_default(const scene::Table* table, const JsonDocument& doc, JsonIndex at) {
    const scene::KeyRow* const row = table ? scene::find_row(*table, doc.key(at)) : nullptr;
    if (row == nullptr) return false;
    if (row->type == scene::KeyType::Bool) return doc.is(at, JsonType::False);
    if (row->type != scene::KeyType::Numbers) return false;
    const bool list = doc.is(at, JsonType::Array);
    JsonIndex c = list ? doc.first(at) : at;
    for (int k = 0; k < row->numbers.arity; ++k) {
        if (list ? c == doc.next(at) : k > 0) return false;
        if (!doc.is(c, JsonType::Number) || float(doc.number(c)) != row->numbers.defaults[size_t(k)]) return false;
        if (list) c = doc.next(c);
    }
    return !list || c == doc.next(at);
}

class Comparison {
public:
    Comparison(const JsonDocument& a, const JsonDocument& b) : a_(a), b_(b) {}

    SceneDifference run() {
        for (const scene::KeyRow& row : scene::kSceneTable.rows) {
            if (row.name == "$schema" || row.name == "format") continue;
            if (row.type == scene::KeyType::List || row.type == scene::KeyType::Map) {
                named(row);
            } else if (row.type == scene::KeyType::Object) {
                fields_of_section(row);
            } else {
                whole(row.name);
            }
        }
        SceneDifference out;
        out.equal = equal_;
        report_["equal"] = equal_;
        out.json = report_.dump(2) + "\n";
        out.lines = std::move(lines_);
        return out;
    }

private:
    // The members of two objects that differ: key, before, after ("" where it is not there).
    struct Field {
        std::string key, a, b;
    };
    std::vector<Field> differing(std::optional<JsonIndex> a, std::optional<JsonIndex> b,
                                 const scene::Table* table) const {
        std::vector<Field> out;
        if (a)
            for (JsonIndex c = a_.first(*a); c < a_.next(*a); c = a_.next(c)) {
                const auto other = b ? b_.find(*b, a_.key(c)) : std::nullopt;
                std::string was = text_of(a_, c), is = other ? text_of(b_, *other) : "";
                if (was != is && (other || !is_default(table, a_, c)))
                    out.push_back({std::string(a_.key(c)), std::move(was), std::move(is)});
            }
        if (b)
            for (JsonIndex c = b_.first(*b); c < b_.next(*b); c = b_.next(c)) {
                if (a && a_.find(*a, b_.key(c))) continue;
                std::string is = text_of(b_, c);
                if (!is_default(table, b_, c)) out.push_back({std::string(b_.key(c)), "", std::move(is)});
            }
        return out;
    }

    static Report json_of(const std::string& text) { return text.empty() ? Report() : Report::parse(text); }
    static std::string brief(const std::string& text) {
        return text.empty() ? "default" : text.size() <= 60 ? text : text.substr(0, 57) + "...";
    }
    void line(std::string_view section, const std::string& what) {
        equal_ = false;
        if (section_ != section) lines_ += formatted("{}\n", section);
        section_ = section;
        lines_ += "  " + what + "\n";
    }
    std::string in_words(const std::vector<Field>& fields) const {
        std::string out;
        for (const Field& f : fields)
            out += formatted("{}{} {} -> {}", out.empty() ? "" : ", ", f.key, brief(f.a), brief(f.b));
        return out;
    }
    static Report in_json(const std::vector<Field>& fields) {
        Report out = Report::object();
        for (const Field& f : fields) out[f.key] = {{"a", json_of(f.a)}, {"b", json_of(f.b)}};
        return out;
    }

    void whole(std::string_view key) {
        const auto a = a_.find(0, key), b = b_.find(0, key);
        const std::string was = a ? text_of(a_, *a) : "", is = b ? text_of(b_, *b) : "";
        if (was == is || (!a && is_default(&scene::kSceneTable, b_, *b)) ||
            (!b && is_default(&scene::kSceneTable, a_, *a)))
            return;
        line(key, formatted("~ {} -> {}", brief(was), brief(is)));
        report_[std::string(key)] = {{"a", json_of(was)}, {"b", json_of(is)}};
    }

    void fields_of_section(const scene::KeyRow& row) {
        const auto a = a_.find(0, row.name), b = b_.find(0, row.name);
        const auto fields = differing(a, b, row.table);
        // An environment that is not there is not one of defaults.
        if (fields.empty() && (row.name != "environment" || bool(a) == bool(b))) return;
        line(row.name, fields.empty() ? (b ? "+" : "-") : "~ " + in_words(fields));
        report_[std::string(row.name)] = in_json(fields);
    }

    void named(const scene::KeyRow& row) {
        const std::vector<Item> as = items_of(a_, row.name), bs = items_of(b_, row.name);
        std::unordered_map<std::string_view, size_t> in_a, in_b;
        for (size_t i = 0; i < as.size(); ++i) in_a.emplace(as[i].name, i);
        for (size_t i = 0; i < bs.size(); ++i) in_b.emplace(bs[i].name, i);
        Report added = Report::array(), removed = Report::array(), changed = Report::array(), moved = Report::array();
        for (const Item& item : as) {
            if (in_b.contains(item.name)) continue;
            removed.push_back(item.name);
            line(row.name, "- " + item.name);
        }
        for (const Item& item : bs) {
            const auto old = in_a.find(item.name);
            if (old == in_a.end()) {
                added.push_back(item.name);
                line(row.name, "+ " + item.name);
                continue;
            }
            const auto fields = differing(as[old->second].at, item.at, row.table);
            if (fields.empty()) continue;
            changed.push_back({{"id", item.name}, {"fields", in_json(fields)}});
            line(row.name, formatted("~ {}: {}", item.name, in_words(fields)));
        }
        // Only the order of edits has a meaning, and of cameras which is first.
        if (row.name == "edits") order(bs, in_a, moved);
        if (row.name == "cameras" && !as.empty() && !bs.empty() && as[0].name != bs[0].name &&
            in_a.contains(bs[0].name)) {
            line(row.name, "< " + bs[0].name + ": is the first now");
            moved.push_back({{"id", bs[0].name}, {"before", as[0].name}});
        }
        if (added.empty() && removed.empty() && changed.empty() && moved.empty()) return;
        Report& out = report_[std::string(row.name)];
        out = {{"added", added}, {"removed", removed}, {"changed", changed}};
        if (row.name == "edits" || row.name == "cameras") out["reordered"] = moved;
    }

    // Most edits stay in order: a longest ascending run of their old places (patience sorting); the others have been moved.
    void order(const std::vector<Item>& bs, const std::unordered_map<std::string_view, size_t>& in_a, Report& moved) {
        std::vector<size_t> old_place, at_b;
        for (size_t i = 0; i < bs.size(); ++i) {
            const auto found = in_a.find(bs[i].name);
            if (found == in_a.end()) continue;
            old_place.push_back(found->second);
            at_b.push_back(i);
        }
        std::vector<size_t> tails, before(old_place.size(), SIZE_MAX);
        for (size_t i = 0; i < old_place.size(); ++i) {
            const auto pile = std::lower_bound(tails.begin(), tails.end(), old_place[i],
                                               [&](size_t t, size_t place) { return old_place[t] < place; });
            if (pile != tails.begin()) before[i] = *(pile - 1);
            if (pile == tails.end())
                tails.push_back(i);
            else
                *pile = i;
        }
        std::vector<bool> stays(old_place.size(), false);
        for (size_t i = tails.empty() ? SIZE_MAX : tails.back(); i != SIZE_MAX; i = before[i]) stays[i] = true;
        for (size_t i = 0; i < old_place.size(); ++i) {
            if (stays[i]) continue;
            const std::string& name = bs[at_b[i]].name;
            const bool last = at_b[i] + 1 == bs.size();
            line("edits", formatted("< {}: now {}", name, last ? "last" : "before " + bs[at_b[i] + 1].name));
            moved.push_back({{"id", name}, {"before", last ? Report() : Report(bs[at_b[i] + 1].name)}});
        }
    }

    const JsonDocument& a_;
    const JsonDocument& b_;
    bool equal_ = true;
    std::string_view section_;
    std::string lines_;
    Report report_;
};

}  // namespace

SceneDifference compare_scenes(const World& a, const World& b) {
    const auto document = [](const World& w) {
        std::vector<scene::PlacedEdit> edits;
        w.impl_->edits.each([&](uint32_t slot) {
            edits.push_back({w.impl_->edits[slot].edit.get(), scene::SceneData::kNowhere});
        });
        return scene::plain_document(w.impl_->data, {w.field_settings, w.lights, w.environment, w.cameras}, edits);
    };
    const JsonDocument first = document(a), second = document(b);
    return Comparison(first, second).run();
}

}  // namespace kiln
