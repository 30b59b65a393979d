// SPDX-License-Identifier: MIT
// Wavefront OBJ: `v` and `f` lines; everything else (normals, groups, materials, lines) is passed over. Polygons become fans.

#include "model/triangles.h"
#include "model/words.h"

#include "base/format.h"

namespace kiln::model {

Result<Triangles> parse_obj(std::string_view text, const std::string& name) {
    Triangles out;
    size_t number = 0;
    const auto fault = [&](const std::string& what) {
        return Error{formatted("{}:{}: {}", name, number, what), ErrorKind::Input};
    };
    std::vector<uint32_t> corners;
    std::string joined;
    for (std::string_view line; next_line(text, line);) {
        ++number;
        if (line.ends_with('\\')) {  // goes on in the next line
            joined.assign(line.substr(0, line.size() - 1));
            for (std::string_view more; next_line(text, more);) {
                ++number;
                const bool again = more.ends_with('\\');
                joined += again ? more.substr(0, more.size() - 1) : more;
                if (!again) break;
            }
            line = joined;
        }
        std::string_view rest = line;
        const std::string_view key = next_word(rest);
        if (key == "v") {
            vec3 p;
            for (float* c : {&p.x, &p.y, &p.z}) {
                const std::string_view word = next_word(rest);
                if (!number_of(word, *c))
                    return fault(formatted("`v` with \"{}\" for a coordinate; write three numbers", word));
            }
            if (out.positions.size() >= 3 * kMostTriangles) return fault("too many corners; simplify the model");
            out.positions.push_back(p);
        } else if (key == "f") {
            corners.clear();
            for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
                if (word.front() == '#') break;
                int64_t index = 0;
                if (!number_of(word.substr(0, word.find('/')), index))
                    return fault(formatted("`f` with \"{}\" for a corner; write numbers such as 1/1/1", word));
                const auto count = int64_t(out.positions.size());
                if (index < 0) index += count + 1;  // counted from the last
                if (index < 1 || index > count)
                    return fault(formatted("`f` names corner {}, but {} corners stand above it; export it again",
                                           word.substr(0, word.find('/')), count));
                corners.push_back(uint32_t(index - 1));
            }
            if (corners.size() < 3) return fault("`f` with fewer than three corners; take the line out");
            if (out.faces.size() + corners.size() > kMostTriangles)
                return fault("too many triangles; simplify the model");
            for (size_t i = 2; i < corners.size(); ++i) out.faces.push_back({corners[0], corners[i - 1], corners[i]});
        }
    }
    return checked(std::move(out), name);
}

}  // namespace kiln::model
