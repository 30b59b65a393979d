// SPDX-License-Identifier: MIT
// kiln query SCENE --points FILE: asks the field at points (or along rays) read as CSV; answers as CSV in the same order.
// Rows are answered in batches, so a pipe may be as long as it likes.

#include "cli/scene.h"
#include "cli/talk.h"
#include "cli/verbs.h"

#include <kiln/world.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

namespace kiln::cli {

namespace {

struct QueryOptions {
    std::string scene, points;
    bool bricks = false, rays = false, nearest = false;
};

constexpr size_t kBatch = 8192;  // rows answered together

struct Row {
    std::array<std::string, 3> text;  // x, y, z as they were written
    std::array<float, 6> numbers;
};

class Input {
public:
    static Result<Input> open(const std::string& path) {
        Input in;
        in.name_ = path == "-" ? "stdin" : path;
        in.file_.reset(path == "-" ? stdin : std::fopen(path.c_str(), "rb"));
        if (!in.file_)
            return Error{path + ": cannot be read: " + std::strerror(errno) + "; check the name", ErrorKind::Input};
        return in;
    }

    /// Next row that has content; false at the end or after a fault.
    bool next(Row& row, size_t columns) {
        while (read_line()) {
            const size_t first = line_.find_first_not_of(" \t");
            if (first == std::string::npos) continue;
            const char c = line_[first];
            const bool header = !seen_ && (c == '_' || c == '"' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z')) &&
                                !line_.starts_with("nan") && !line_.starts_with("inf") && !line_.starts_with("NaN") &&
                                !line_.starts_with("Inf");
            seen_ = true;
            if (!header) return parse(row, columns);
        }
        return false;
    }
    const std::optional<Error>& error() const { return error_; }
    bool fail(const std::string& message) {
        error_ = Error{name_ + ":" + std::to_string(number_) + ": " + message, ErrorKind::Input};
        return false;
    }

private:
    struct Close {
        void operator()(FILE* f) const {
            if (f != stdin) std::fclose(f);
        }
    };

    bool read_line() {
        line_.clear();
        char buffer[4096];
        bool any = false;
        while (std::fgets(buffer, sizeof buffer, file_.get())) {
            any = true;
            line_ += buffer;
            if (line_.back() == '\n') break;
            if (line_.size() > (1u << 16)) {
                ++number_;
                return fail("a line of more than 65536 characters; is this a CSV file?");
            }
        }
        if (!any) {
            if (std::ferror(file_.get())) {
                ++number_;
                fail(std::string("cannot be read: ") + std::strerror(errno));
            }
            return false;
        }
        while (!line_.empty() && (line_.back() == '\n' || line_.back() == '\r')) line_.pop_back();
        if (number_ == 0 && line_.starts_with("\xEF\xBB\xBF")) line_.erase(0, 3);
        ++number_;
        return true;
    }

    bool parse(Row& row, size_t columns) {
        const char* names = columns == 3 ? "x,y,z" : "ox,oy,oz,dx,dy,dz";
        size_t column = 0, at = 0;
        while (true) {
            size_t end = line_.find(',', at);
            if (end == std::string::npos) end = line_.size();
            std::string_view field = std::string_view(line_).substr(at, end - at);
            while (!field.empty() && (field.front() == ' ' || field.front() == '\t')) field.remove_prefix(1);
            while (!field.empty() && (field.back() == ' ' || field.back() == '\t')) field.remove_suffix(1);
            if (column == columns) return fail("more than " + std::to_string(columns) + " columns; a row is " + names);
            float v = 0;
            const std::string_view digits = field.starts_with('+') ? field.substr(1) : field;
            const auto [stop, code] = std::from_chars(digits.data(), digits.data() + digits.size(), v);
            if (digits.empty() || (code == std::errc() && stop != digits.data() + digits.size()) ||
                code == std::errc::invalid_argument)
                return fail("\"" + std::string(field.substr(0, 40)) + "\" is not a number; a row is " + names);
            if (code == std::errc::result_out_of_range)
                v = std::abs(std::strtof(std::string(digits).c_str(), nullptr)) > 1 ? INFINITY : 0;
            if (!std::isfinite(v))
                return fail("\"" + std::string(field.substr(0, 40)) + "\" is not finite; write a finite number");
            row.numbers[column] = v;
            if (column < 3) row.text[column] = field;
            ++column;
            if (end == line_.size()) break;
            at = end + 1;
        }
        if (column < columns)
            return fail(std::to_string(column) + " columns where there must be " + std::to_string(columns) +
                        "; a row is " + names);
        return true;
    }

    std::unique_ptr<FILE, Close> file_;
    std::string name_, line_;
    size_t number_ = 0;
    bool seen_ = false;
    std::optional<Error> error_;
};

void append(std::string& out, float v) {
    char buffer[40];
    out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, v).ptr);
    out += ',';
}

// A name as a CSV field.
void append_name(std::string& out, std::string_view name) {
    if (name.find_first_of(",\"\r\n") == std::string_view::npos) {
        out += name;
    } else {
        out += '"';
        for (const char c : name) {
            if (c == '"') out += '"';
            out += c;
        }
        out += '"';
    }
    out += '\n';
}

std::vector<vec3> points_of(const std::vector<Row>& rows) {
    std::vector<vec3> points;
    points.reserve(rows.size());
    for (const Row& r : rows) points.push_back({r.numbers[0], r.numbers[1], r.numbers[2]});
    return points;
}

void append_point(std::string& out, const Row& row, float distance, vec3 normal, std::string_view material) {
    for (const std::string& t : row.text) out += t + ",";
    for (const float v : {distance, normal.x, normal.y, normal.z}) append(out, v);
    append_name(out, material);
}

void answer_points(const World& world, const std::vector<Row>& rows, FieldSource source, std::string& out) {
    const std::vector<FieldSample> samples = world.sample(points_of(rows), source);
    for (size_t i = 0; i < rows.size(); ++i)
        append_point(out, rows[i], samples[i].distance, samples[i].normal, world.material_name(samples[i].material));
}

void answer_nearest(const World& world, const WorldView& view, const std::vector<Row>& rows, std::string& out) {
    const std::vector<NearestPoint> nearest = view.nearest(points_of(rows));
    for (size_t i = 0; i < rows.size(); ++i) {
        const NearestPoint& n = nearest[i];
        append_point(out, rows[i], n.found ? n.distance : INFINITY, n.normal, world.material_name(n.material));
    }
}

void answer_rays(const World& world, const std::vector<Row>& rows, FieldSource source, std::string& out) {
    std::vector<Ray> rays;
    rays.reserve(rows.size());
    for (const Row& r : rows) {
        const auto& n = r.numbers;
        rays.push_back({.origin = {n[0], n[1], n[2]}, .direction = {n[3], n[4], n[5]}});
    }
    for (const RayHit& hit : world.cast(rays, source)) {
        if (!hit.hit) {
            out += "0,,,,,,,,\n";
            continue;
        }
        out += "1,";
        for (const float v :
             {hit.t, hit.position.x, hit.position.y, hit.position.z, hit.normal.x, hit.normal.y, hit.normal.z})
            append(out, v);
        const Edit* edit = world.find(hit.edit);
        append_name(out, edit ? std::string_view(edit->name) : std::string_view());
    }
}

int query(const QueryOptions& o) {
    if (o.nearest && (o.bricks || o.rays)) {
        say("kiln query: --nearest does not go together with --field or --rays; leave it out");
        return kUsage;
    }
    auto input = Input::open(o.points);
    if (!input) return fail(input.error());
    auto world = load_scene(o.scene);
    if (!world) return fail(world.error());
    std::string out = o.rays ? "hit,t,x,y,z,nx,ny,nz,edit\n" : "x,y,z,distance,nx,ny,nz,material\n";
    const WorldView view = world->view();
    const FieldSource source = o.bricks ? FieldSource::Bricks : FieldSource::Exact;
    std::vector<Row> rows;
    bool more = true;
    while (more) {
        rows.clear();
        Row row;
        while (rows.size() < kBatch && (more = input->next(row, o.rays ? 6 : 3))) {
            const auto& n = row.numbers;
            if (o.rays && n[3] == 0 && n[4] == 0 && n[5] == 0) {
                more = input->fail("a ray without a direction; dx,dy,dz must not all be 0");
                break;
            }
            rows.push_back(row);
        }
        if (o.rays) {
            answer_rays(*world, rows, source, out);
        } else if (o.nearest) {
            answer_nearest(*world, view, rows, out);
        } else {
            answer_points(*world, rows, source, out);
        }
        if (!put(out)) break;
        out.clear();
    }
    const int written = finish_data();
    if (input->error()) return fail(*input->error());
    return written;
}

}  // namespace

void add_query(CLI::App& app, Run& run) {
    auto o = std::make_shared<QueryOptions>();
    CLI::App* verb = app.add_subcommand("query",
                                        "Answers distance, normal and material at points, as CSV. Needs no device.\n\n"
                                        "Examples:\n"
                                        "  echo 0,1,0 | kiln query potter --points -\n"
                                        "  kiln query quarry --points points.csv > answers.csv\n"
                                        "  kiln query quarry --rays --points rays.csv");
    verb->add_option("SCENE", o->scene, "a scene file, or a bundled scene's name")->required();
    verb->add_option("--points", o->points, "CSV of x,y,z (rays: ox,oy,oz,dx,dy,dz), a header is optional; - for stdin")
        ->required();
    verb->add_flag("--field", o->bricks,
                   "from the baked bricks instead of the exact edits; rays too, which is faster for many");
    verb->add_flag("--rays", o->rays, "rows are rays; answers hit,t,x,y,z,nx,ny,nz,edit");
    verb->add_flag("--nearest", o->nearest, "true nearest-surface distance, also where the edits' own value is less");
    verb->callback([o, &run] { run = [o] { return query(*o); }; });
}

}  // namespace kiln::cli
