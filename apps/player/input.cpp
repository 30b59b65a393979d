// SPDX-License-Identifier: MIT
#include "player/input.h"

#include <kiln/world.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>

namespace kiln::player {

namespace {

constexpr std::string_view kKeys[] = {
    "a", "b",      "d",     "e", "f",          "g",           "k",         "p",          "q",  "r",  "s",  "v",
    "w", "y",      "z",     "1", "2",          "3",           "4",         "5",          "6",  "7",  "8",  "9",
    ".", "escape", "space", "h", "left shift", "right shift", "left ctrl", "right ctrl", "f1", "f2", "f3", "f4"};
constexpr std::string_view kButtons[] = {"left", "middle", "right"};
constexpr std::string_view kWords[] = {"frame", "key", "down", "mouse", "button", "look", "wheel", "size", "close"};
constexpr int kMostFrame = 1'000'000'000;
constexpr double kMostPixels = 16384;

// One line: an object of words with a number, a word, true or false, or two numbers.
class Line {
public:
    explicit Line(std::string_view text) : text_(text) {}

    struct Value {
        enum class Kind { Number, Text, Flag, Pair } kind = Kind::Number;
        double number = 0, second = 0;
        std::string text{};
        bool flag = false;
    };

    // Calls found(word, value) for each; answers what is wrong, or nothing.
    template <typename Found>
    std::string each(Found&& found) {
        if (!take('{')) return "not an object; write {\"frame\": 0, \"key\": \"w\", \"down\": true}";
        if (take('}')) return end();
        do {
            std::string word;
            Value value;
            if (!string(word) || !take(':') || !read(value)) return fault();
            if (std::string wrong = found(word, value); !wrong.empty()) return wrong;
        } while (take(','));
        return take('}') ? end() : fault();
    }

private:
    std::string fault() const {
        return "column " + std::to_string(at_ + 1) +
               ": not JSON that is read here; values are numbers, \"words\", true, false and [x, y]";
    }
    std::string end() {
        blank();
        return at_ == text_.size() ? "" : "column " + std::to_string(at_ + 1) + ": more after the object; one a line";
    }
    void blank() {
        while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\r')) ++at_;
    }
    bool take(char c) {
        blank();
        if (at_ >= text_.size() || text_[at_] != c) return false;
        ++at_;
        return true;
    }
    bool take(std::string_view word) {
        if (text_.substr(at_, word.size()) != word) return false;
        at_ += word.size();
        return true;
    }
    bool string(std::string& out) {
        if (!take('"')) return false;
        const size_t to = text_.find('"', at_);
        if (to == std::string_view::npos || text_.substr(at_, to - at_).find('\\') != std::string_view::npos)
            return false;
        out = text_.substr(at_, to - at_);
        at_ = to + 1;
        return true;
    }
    bool number(double& out) {
        blank();
        const auto [to, code] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), out);
        if (code != std::errc() || !std::isfinite(out)) return false;
        at_ = size_t(to - text_.data());
        return true;
    }
    bool read(Value& out) {
        blank();
        if (at_ >= text_.size()) return false;
        if (text_[at_] == '"') return out.kind = Value::Kind::Text, string(out.text);
        if (take("true")) return out.kind = Value::Kind::Flag, out.flag = true;
        if (take("false")) return out.kind = Value::Kind::Flag, true;
        if (take('[')) {
            out.kind = Value::Kind::Pair;
            return number(out.number) && take(',') && number(out.second) && take(']');
        }
        return number(out.number);
    }

    std::string_view text_;
    size_t at_ = 0;
};

std::string mend(std::string_view near, const std::string& otherwise) {
    return near.empty() ? otherwise : "did you mean \"" + std::string(near) + "\"?";
}

// The events of a line, or what is wrong with it.
std::string events_of(std::string_view text, std::vector<InputEvent>& out) {
    using Value = Line::Value;
    std::optional<Value> frame, key, down, mouse, button, look, wheel, size, close;
    const std::pair<std::string_view, std::optional<Value>*> places[] = {
        {"frame", &frame}, {"key", &key},     {"down", &down}, {"mouse", &mouse}, {"button", &button},
        {"look", &look},   {"wheel", &wheel}, {"size", &size}, {"close", &close}};
    const auto kind_of = [](std::string_view word) {
        if (word == "key" || word == "button") return Value::Kind::Text;
        if (word == "down" || word == "close") return Value::Kind::Flag;
        return word == "frame" || word == "wheel" ? Value::Kind::Number : Value::Kind::Pair;
    };
    constexpr std::string_view kWanted[] = {"a number", "a word in quotes", "true or false", "two numbers, [x, y]"};
    std::string wrong = Line(text).each([&](const std::string& word, const Value& value) -> std::string {
        for (const auto& [name, place] : places) {
            if (word != name) continue;
            if (*place) return "\"" + word + "\" twice; leave one of them out";
            if (value.kind != kind_of(word))
                return "\"" + word + "\" wants " + std::string(kWanted[size_t(kind_of(word))]);
            *place = value;
            return "";
        }
        return "unknown word \"" + word + "\"; " +
               mend(nearest_word(word, kWords), "use frame, key, down, mouse, button, look, wheel, size or close");
    });
    if (!wrong.empty()) return wrong;
    if (!frame) return "no \"frame\"; say before which one it happens";
    if (!(frame->number >= 0 && frame->number <= kMostFrame) || frame->number != std::floor(frame->number))
        return "\"frame\" is a whole number from 0";
    const int at = int(frame->number);
    const int things =
        (key ? 1 : 0) + (mouse || button ? 1 : 0) + (look ? 1 : 0) + (wheel ? 1 : 0) + (size ? 1 : 0) + (close ? 1 : 0);
    if (things != 1) return "one thing a line: key, mouse (with button or without), look, wheel, size or close";
    if ((key || button) != bool(down))
        return down ? "\"down\" belongs to a key or a button"
                    : "no \"down\": true when it is pressed, false when it is let go";
    const auto push = [&](InputEvent::Kind kind, const std::string& name, const Value* place) {
        out.push_back(
            {at, kind, name, down && down->flag, place ? float(place->number) : 0, place ? float(place->second) : 0});
    };
    for (const auto& pair : {mouse, look, size})
        if (pair && !(std::abs(pair->number) <= kMostPixels && std::abs(pair->second) <= kMostPixels))
            return "pixels are at most 16384";
    if (key) {
        for (const std::string_view known : kKeys)
            if (known == key->text) return push(InputEvent::Kind::Key, key->text, nullptr), "";
        return "no key \"" + key->text + "\" means anything; " +
               mend(nearest_word(key->text, kKeys), "`kiln view --help` lists those that do");
    }
    if (mouse) push(InputEvent::Kind::Mouse, "", &*mouse);
    if (button) {
        for (const std::string_view known : kButtons)
            if (known == button->text)
                return push(InputEvent::Kind::Button, button->text, mouse ? &*mouse : nullptr), "";
        return "no button \"" + button->text + "\"; use left, middle or right";
    }
    if (look) push(InputEvent::Kind::Look, "", &*look);
    if (wheel) {
        const Value turned{.second = wheel->number};
        push(InputEvent::Kind::Wheel, "", &turned);
    }
    if (size) {
        if (size->number < 0 || size->second < 0) return "\"size\" is in pixels, 0 or more";
        push(InputEvent::Kind::Size, "", &*size);
    }
    if (close) {
        if (!close->flag) return "\"close\" is true, or left out";
        push(InputEvent::Kind::Close, "", nullptr);
    }
    return "";
}

}  // namespace

std::span<const std::string_view> known_keys() { return kKeys; }

Result<std::vector<InputEvent>> parse_input_events(std::string_view text, const std::string& name) {
    std::vector<InputEvent> out;
    int number = 1, last = 0;
    for (size_t from = 0; from < text.size(); ++number) {
        const size_t to = std::min(text.find('\n', from), text.size());
        const std::string_view line = text.substr(from, to - from);
        from = to + 1;
        if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
        const auto fault = [&](const std::string& what) {
            return Error{name + ":" + std::to_string(number) + ": " + what, ErrorKind::Input};
        };
        if (std::string wrong = events_of(line, out); !wrong.empty()) return fault(wrong);
        if (out.back().frame < last)
            return fault("frame " + std::to_string(out.back().frame) + " after frame " + std::to_string(last) +
                         "; order the lines by frame");
        last = out.back().frame;
    }
    return out;
}

Result<std::vector<InputEvent>> read_input_events(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) return Error{path + ": cannot be read; --keys wants a file of input events", ErrorKind::Input};
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    if (in.bad()) return Error{path + ": reading stopped half-way", ErrorKind::Input};
    return parse_input_events(text, path);
}

void InputState::take(const InputEvent& e) {
    const auto set = [&](auto& held) { e.down ? (void)held.insert(e.name) : (void)held.erase(e.name); };
    if (e.kind == InputEvent::Kind::Key) set(keys);
    if (e.kind == InputEvent::Kind::Button) set(buttons);
    if (e.kind == InputEvent::Kind::Mouse) x = e.x, y = e.y;
}

}  // namespace kiln::player
