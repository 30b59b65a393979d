// SPDX-License-Identifier: MIT
// Bounds and rates of whole edits: outside its box an edit's value is at least rate · distance to the box. Over every shape, warp,
// operation, transform and random trees of them, with the program's value in double precision.

#include "texts.h"

#include "sdf/eval.h"
#include "sdf/judge.h"
#include "sdf/program.h"

#include <kiln/shapes.h>

namespace kiln::sdf {
namespace {

struct OneEdit {
    std::vector<Edit> edits{Edit{}};
    std::vector<Object> objects;
    HeightGrid grid{kGridSide, kGridSide, {std::begin(kGrid), std::end(kGrid)}};
    MeshGrid mesh = ball_grid();
    Source source() const { return {.edits = edits, .objects = objects, .grids = {&grid, 1}, .meshes = {&mesh, 1}}; }
    Node& node() { return edits[0].node; }
};

constexpr int kAny = -1;

Shape random_shape(RandomValues& random, int kind = kAny) {
    Shape out;
    out.kind = uint16_t(kind == kAny ? random.below(int(shape_rows().size())) : kind);
    if (shape_rows()[out.kind].how == KindRow::Custom) out.kind = 0;  // another test's
    const KindRow& row = shape_rows()[out.kind];
    out.params = random.params(row);
    // Of about a metre, so that what meets in a tree overlaps.
    for (const FieldRow& f : row.fields()) {
        for (int i = 0; i < f.arity && f.unit == "m"; ++i)
            out.params[size_t(f.offset + i)] = std::min(out.params[size_t(f.offset + i)], 1.0f);
        if (f.range == "internal") out.params[size_t(f.offset)] = 0;
    }
    if (row.how == KindRow::Sampled) out.data = "0";
    if (row.how == KindRow::Formula) {
        out.data = "length(p) - 0.2";
        out.params[0] = 0;  // lipschitz
    }
    return out;
}

Warp random_warp(RandomValues& random, int kind = kAny) {
    Warp out;
    out.kind = uint16_t(kind == kAny ? random.below(int(warp_rows().size())) : kind);
    out.params = random.params(warp_rows()[out.kind]);
    if (warp_rows()[out.kind].how == KindRow::Copies) {
        for (size_t axis = 0; axis < 3; ++axis) {
            out.params[axis] = random.one_in(3) ? 0.0f : float(random.in(2, 12));
            out.params[axis + 3] = float(1 + random.below(4));
        }
    }
    return out;
}

Transform random_transform(RandomValues& random) {
    Transform out;
    const auto number = [&] { return float(random.in(-1, 1)); };
    out.position = {number(), number(), number()};
    out.rotation = axis_angle(normalize(vec3{number(), number(), number() + 1.1f}), 3 * number());
    const auto scale = [&] { return float(std::pow(4.0, random.in(-1, 1))); };
    if (random.one_in(3)) out.scale = vec3{1, 1, 1} * scale();
    if (random.one_in(3)) out.scale = {scale(), scale(), scale()};
    return out;
}

void dress(RandomValues& random, Node& node) {
    node.transform = random_transform(random);
    for (int n = random.below(3); n > 0; --n) node.domain.push_back(random_warp(random));
}

// A tree of up to `most` nodes; leaves may place one of the objects before `objects`.
Object random_tree(RandomValues& random, int most, int objects) {
    Object out;
    out.nodes.emplace_back();
    for (size_t n = 0; n < out.nodes.size(); ++n) {
        Node node;
        dress(random, node);
        if (n == 0 || (random.one_in(3) && int(out.nodes.size()) < most)) {
            node.kind = Node::Kind::Fold;
            node.op = Op(random.below(3));
            node.blend_radius = random.one_in(2) ? 0.0f : float(random.in(0.01, 0.8));
            for (int c = random.below(4) + 1; c > 0; --c) {
                node.children.push_back(uint32_t(out.nodes.size()));
                out.nodes.emplace_back();
            }
        } else if (objects > 0 && random.one_in(3)) {
            node.kind = Node::Kind::Object;
            node.object = ObjectId{uint32_t(random.below(objects)), 0};
        } else {
            node.shape = random_shape(random);
        }
        out.nodes[n] = node;
    }
    return out;
}

std::string describe(const Node& node) {
    std::ostringstream out;
    out.precision(9);
    if (node.kind == Node::Kind::Shape) out << show(shape_rows()[node.shape.kind], node.shape.params);
    if (node.kind == Node::Kind::Object) out << "object " << node.object.index;
    if (node.kind == Node::Kind::Fold) {
        out << "op " << int(node.op) << " k " << node.blend_radius << " of";
        for (uint32_t c : node.children) out << ' ' << c;
    }
    for (const Warp& w : node.domain) out << " -> " << show(warp_rows()[w.kind], w.params);
    const vec3 s = node.transform.scale;
    out << " scale (" << s.x << ' ' << s.y << ' ' << s.z << ")";
    return out.str();
}
std::string describe(const OneEdit& scene) {
    std::string out = "\nedit: " + describe(scene.edits[0].node);
    for (const Object& o : scene.objects) {
        out += "\nobject:";
        for (const Node& n : o.nodes) out += "\n  " + describe(n);
    }
    return out;
}

double off(double x, float lo, float hi) { return std::max({double(lo) - x, x - double(hi), 0.0}); }

// A point beyond at least one finite face, near or far; nothing where every face is infinite.
bool outside_point(RandomValues& random, const Box3& box, double size, Point& p) {
    const float lo[3] = {box.min.x, box.min.y, box.min.z}, hi[3] = {box.max.x, box.max.y, box.max.z};
    bool any = false;
    for (size_t a = 0; a < 3; ++a) {
        const double from = std::isfinite(lo[a]) ? double(lo[a]) : std::isfinite(hi[a]) ? double(hi[a]) - size : -size;
        const double to = std::isfinite(hi[a]) ? double(hi[a]) : from + size;
        const double beyond = size * std::pow(10.0, random.in(-3, 1));
        const int where = random.below(3);
        p[a] = random.in(from, to);
        if (where == 0 && std::isfinite(lo[a])) p[a] = from - beyond;
        if (where == 1 && std::isfinite(hi[a])) p[a] = to + beyond;
        any = any || off(p[a], lo[a], hi[a]) > 0;
    }
    return any;
}

// The smallest value / (rate · distance) seen; infinite where the scene does not compile or nothing is outside.
double expect_rate(RandomValues& random, const OneEdit& scene, int points) {
    double tightest = std::numeric_limits<double>::infinity();
    const Result<Program> program = compile(scene.source());
    if (!program) return tightest;
    const EditSpan& edit = program->edits[0];
    RC_ASSERT(edit.rate > 0 && edit.rate <= 1);
    double size = 1;
    for (float face : {edit.bounds.min.x, edit.bounds.min.y, edit.bounds.min.z, edit.bounds.max.x, edit.bounds.max.y,
                       edit.bounds.max.z})
        if (std::isfinite(face)) size = std::max(size, std::fabs(double(face)));
    for (int i = 0; i < points; ++i) {
        Point p;
        if (!outside_point(random, edit.bounds, size, p)) continue;
        const double far =
            std::hypot(off(p[0], edit.bounds.min.x, edit.bounds.max.x), off(p[1], edit.bounds.min.y, edit.bounds.max.y),
                       off(p[2], edit.bounds.min.z, edit.bounds.max.z));
        const double promised = double(edit.rate) * far;
        const double value = evaluate(view(*program), dvec3{p[0], p[1], p[2]});
        tightest = std::min(tightest, value / promised);
        if (value < promised * (1 - 1e-5) - 2e-5 * (size + magnitude(p)) * double(edit.rate)) {
            RC_FAIL(describe(scene) + "\n at " + show(p) + ": " + std::to_string(value) + " < " +
                    std::to_string(edit.rate) + " * " + std::to_string(far));
        }
    }
    return tightest;
}

Around around_edit(const Program& program) {
    const Box3& b = program.edits[0].bounds;
    return Around({{b.min.x, b.min.y, b.min.z}, {b.max.x, b.max.y, b.max.z}});
}

void expect_one_lipschitz(RandomValues& random, const OneEdit& scene, int points) {
    const Result<Program> program = compile(scene.source());
    if (!program) return;
    const Around around = around_edit(*program);
    for (int i = 0; i < points; ++i) {
        const Point p = around.point(random);
        const Point q = beside(random, p, around.size * std::pow(10.0, random.in(-4, 0.3)));
        const double change = std::fabs(evaluate(view(*program), dvec3{p[0], p[1], p[2]}) -
                                        evaluate(view(*program), dvec3{q[0], q[1], q[2]}));
        if (change > between(p, q) * (1 + 1e-5) + 3e-6 * (1 + around.size + magnitude(p)))
            RC_FAIL(describe(scene) + "\n too steep between " + show(p) + " and " + show(q) + ": " +
                    std::to_string(change / between(p, q)));
    }
}

class RateOfEachShape : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Sdf, RateOfEachShape, testing::Range(0, int(shape_rows().size())),
                         [](const auto& row) { return std::string(shape_rows()[size_t(row.param)].name); });

TEST_P(RateOfEachShape, IsOneUnderUniformScaleAndHoldsUnderAny) {
    for_all("shape", [&](RandomValues& random) {
        OneEdit scene;
        scene.node().shape = random_shape(random, GetParam());
        scene.node().transform = random_transform(random);
        expect_rate(random, scene, 60);
        const float s = scene.node().transform.scale.x;
        scene.node().transform.scale = {s, s, s};
        expect_rate(random, scene, 60);
        const Result<Program> program = compile(scene.source());
        // Composites are trees: spaceship's hull has a scale of its own.
        RC_ASSERT(program->edits[0].rate == 1.0f || GetParam() >= primitive_count());
    });
}

class RateOfEachWarp : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Sdf, RateOfEachWarp, testing::Range(0, int(warp_rows().size())),
                         [](const auto& row) { return std::string(warp_rows()[size_t(row.param)].name); });

TEST_P(RateOfEachWarp, AndSlopeHoldOverShapesOfAnyScale) {
    int judged = 0;
    for_all("warp", [&](RandomValues& random) {
        OneEdit scene;
        Object squeezed;
        squeezed.nodes.emplace_back();
        squeezed.nodes[0].shape = random_shape(random);
        squeezed.nodes[0].transform = random_transform(random);
        const auto squeeze = [&] { return float(random.one_in(2) ? 1 : random.in(0.1, 0.5)); };
        if (random.one_in(2)) squeezed.nodes[0].transform.scale = {squeeze(), squeeze(), squeeze()};
        scene.objects.push_back(squeezed);
        scene.node().kind = Node::Kind::Object;
        scene.node().object = ObjectId{0, 0};
        scene.node().domain = {random_warp(random, GetParam())};
        scene.node().transform = random_transform(random);
        judged += std::isfinite(expect_rate(random, scene, 100));
        expect_one_lipschitz(random, scene, 100);
    });
    EXPECT_GT(judged, 10);
}

TEST(Rate, HoldsOverRandomTrees) {
    int judged = 0;
    for (int round = 0; round < 10; ++round) {
        for_all("trees", [&](RandomValues& random) {
            OneEdit scene;
            for (int o = 0; o < 3; ++o) scene.objects.push_back(random_tree(random, 12, o));
            scene.node().kind = Node::Kind::Object;
            scene.node().object = ObjectId{2, 0};
            dress(random, scene.node());
            judged += std::isfinite(expect_rate(random, scene, 60));
        });
    }
    EXPECT_GT(judged, 100);
}

TEST(Trees, AreOneLipschitzAndTheJudgesValue) {
    // About one tree in three is one that can be. How many of a seed are varies (once 90 of 500), so there are more until there are enough.
    constexpr int kEnough = 100;
    int judged = 0;
    for (int round = 0; round < 5 || (judged < kEnough && round < 50); ++round) {
        for_all("trees", [&](RandomValues& random) {
            OneEdit scene;
            for (int o = 0; o < 2; ++o) scene.objects.push_back(random_tree(random, 8, o));
            scene.node().kind = Node::Kind::Object;
            scene.node().object = ObjectId{1, 0};
            dress(random, scene.node());
            expect_one_lipschitz(random, scene, 40);
            const Result<Program> program = compile(scene.source());
            const Result<Judge> judge = Judge::create(scene.source());
            RC_ASSERT(bool(program) == bool(judge));
            if (!program) return;
            ++judged;
            const Around around = around_edit(*program);
            for (int i = 0; i < 40; ++i) {
                const Point p = around.point(random);
                const double value = evaluate(view(*program), dvec3{p[0], p[1], p[2]});
                const double expected = judge->distance({p[0], p[1], p[2]});
                if (std::fabs(value - expected) > 1.2e-5 * (1 + around.size + magnitude(p)))
                    RC_FAIL(describe(scene) + "\n at " + show(p) + ": " + std::to_string(value) + ", the judge says " +
                            std::to_string(expected));
            }
        });
    }
    EXPECT_GE(judged, kEnough);
}

// ---- Each part of the proof with the scene that needs it.

Node shaped(Shape shape, vec3 scale = {1, 1, 1}, vec3 position = {}) {
    Node out;
    out.shape = std::move(shape);
    out.transform.scale = scale;
    out.transform.position = position;
    return out;
}

OneEdit folded(Op op, float blend_radius, const std::vector<Node>& children) {
    OneEdit scene;
    Object object;
    object.nodes.emplace_back();
    object.nodes[0].kind = Node::Kind::Fold;
    object.nodes[0].op = op;
    object.nodes[0].blend_radius = blend_radius;
    for (const Node& child : children) {
        object.nodes[0].children.push_back(uint32_t(object.nodes.size()));
        object.nodes.push_back(child);
    }
    scene.objects.push_back(object);
    scene.node().kind = Node::Kind::Object;
    scene.node().object = ObjectId{0, 0};
    return scene;
}

TEST(Rate, RoundOfASqueezedBallReachesFarther) {
    OneEdit scene;
    Object squeezed;
    squeezed.nodes = {shaped(Sphere{.radius = 0.5f}, {1, 1, 6})};
    scene.objects.push_back(squeezed);
    scene.node().kind = Node::Kind::Object;
    scene.node().object = ObjectId{0, 0};
    for (const Warp& warp : {Warp(Round{.radius = 0.2f}), Warp(Shell{.thickness = 0.4f})}) {
        scene.node().domain = {warp};
        EXPECT_LT(evaluate(view(*compile(scene.source())), dvec3{0, 0, 4.1}), 0) << "beyond 3 + 0.2";
        for_all("squeezed", [&](RandomValues& random) { expect_rate(random, scene, 200); });
    }
}

TEST(Slope, WhereTheEndsOfAnUnevenBarMeetTheValueDoesNotJump) {
    Object bar;
    bar.nodes = {shaped(Cone{.half_height = 3.1f, .radius_bottom = 0.4f, .radius_top = 0.05f})};
    bar.nodes[0].transform.rotation = axis_angle({0, 0, 1}, -1.5707964f);  // along X
    OneEdit scene;
    scene.objects.push_back(bar);
    scene.node().kind = Node::Kind::Object;
    scene.node().object = ObjectId{0, 0};
    scene.node().domain = {Bend{.curvature = 1}};
    ASSERT_TRUE(compile(scene.source()));
    for_all("seam", [&](RandomValues& random) { expect_one_lipschitz(random, scene, 1000); });
    const auto at = [&](double x, double y) { return evaluate(view(*compile(scene.source())), dvec3{x, y, 0}); };
    EXPECT_NEAR(at(1e-6, 2.4), at(-1e-6, 2.4), 1e-5) << "beyond the thin end, beside the thick one";
}

TEST(Slope, NearTheCentreOfABendHoldsForAChildThatGrowsSlowly) {
    // Its value grows by a twentieth along Y, so it is small at the centre of the circle, around which the bend stretches without end.
    Object plank;
    plank.nodes = {shaped(Box{.half_extents = {2.4f, 0.02f, 0.2f}}, {1, 20, 1})};
    OneEdit scene;
    scene.objects.push_back(plank);
    scene.node().kind = Node::Kind::Object;
    scene.node().object = ObjectId{0, 0};
    scene.node().domain = {Bend{.curvature = 1}};
    const auto program = compile(scene.source());
    ASSERT_TRUE(program);
    RandomValues random(5);
    for (int i = 0; i < 20000; ++i) {
        const Point p{random.in(-0.4, 0.4), random.in(0.6, 1.4), random.in(-0.4, 0.4)};
        const Point q = beside(random, p, 0.01);
        const double change = std::fabs(evaluate(view(*program), dvec3{p[0], p[1], p[2]}) -
                                        evaluate(view(*program), dvec3{q[0], q[1], q[2]}));
        ASSERT_LE(change, between(p, q) * (1 + 1e-4) + 1e-6) << show(p) << ' ' << show(q);
    }
}

TEST(Rate, ManyBlendedBallsOnOneSpotBulgeFartherThanTwo) {
    const OneEdit scene = folded(Op::Union, 0.4f, std::vector<Node>(6, shaped(Sphere{.radius = 0.5f})));
    EXPECT_LT(evaluate(view(*compile(scene.source())), dvec3{0.7, 0, 0}), 0) << "a pair reaches 0.6";
    for_all("balls", [&](RandomValues& random) { expect_rate(random, scene, 200); });
}

TEST(Rate, SqueezedOnesBulgeByTheirRateFarther) {
    const OneEdit scene = folded(Op::Union, 0.4f, std::vector<Node>(2, shaped(Sphere{.radius = 0.5f}, {1, 1, 4})));
    EXPECT_LT(evaluate(view(*compile(scene.source())), dvec3{0, 0, 2.35}), 0) << "the pair alone reaches 2";
    for_all("balls", [&](RandomValues& random) { expect_rate(random, scene, 200); });
}

TEST(Rate, DisplacedGroundIsBoundedByItsHighestHill) {
    OneEdit scene;
    scene.node().shape = Plane{};
    scene.node().domain = {Displace{.amplitude = 0.2f, .frequency = 3}};
    const auto program = compile(scene.source());
    ASSERT_TRUE(program && std::isfinite(program->edits[0].bounds.max.y));
    EXPECT_EQ(program->edits[0].rate, 1);
    EXPECT_NEAR(evaluate(view(*program), dvec3{0, 100, 0}), 99.8, 1e-5);
    for_all("ground", [&](RandomValues& random) { expect_rate(random, scene, 200); });
}

TEST(Rate, AnIntersectionsBoxIsFartherThanAnyOfItsOperands) {
    const OneEdit scene = folded(Op::Intersect, 0,
                                 {shaped(Box{.half_extents = {0.2f, 2, 2}}), shaped(Box{.half_extents = {2, 0.2f, 2}}),
                                  shaped(Box{.half_extents = {2, 2, 0.2f}})});
    const auto program = compile(scene.source());
    EXPECT_NEAR(program->edits[0].rate, 1 / std::sqrt(3.0f), 1e-6f);
    EXPECT_NEAR(evaluate(view(*program), dvec3{1.2, 1.2, 1.2}), 1, 1e-6) << "sqrt(3) from the box";
    for_all("corner", [&](RandomValues& random) { expect_rate(random, scene, 200); });
    const OneEdit one =
        folded(Op::Intersect, 0, {shaped(Sphere{.radius = 2}), shaped(Box{.half_extents = {0.2f, 0.2f, 0.2f}})});
    EXPECT_EQ(compile(one.source())->edits[0].rate, 1) << "every face is the box's";
}

TEST(Rate, AGapPulledOpenBesideTheShapeIsInsideItsBounds) {
    OneEdit scene;
    Object aside;
    aside.nodes = {shaped(Sphere{.radius = 0.2f}, {1, 1, 1}, {-0.3f, 0, 0})};
    scene.objects.push_back(aside);
    scene.node().kind = Node::Kind::Object;
    scene.node().object = ObjectId{0, 0};
    scene.node().domain = {Elongate{.half_extents = {2, 0, 0}}};
    for_all("gap", [&](RandomValues& random) { expect_rate(random, scene, 200); });
}

}  // namespace
}  // namespace kiln::sdf
