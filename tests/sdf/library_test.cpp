// SPDX-License-Identifier: MIT
// Every composite: its tree compiles, is 1-Lipschitz, lies in its bounds, has the size its record promises and grows with it.

#include "texts.h"

#include "sdf/eval.h"
#include "sdf/library/library.h"
#include "sdf/program.h"

namespace kiln::sdf {
namespace {

class EachComposite : public testing::TestWithParam<int> {
protected:
    uint16_t kind() const { return uint16_t(GetParam()); }
    const KindRow& row() const { return shape_rows()[kind()]; }
    std::string name() const { return std::string(row().name); }
    Params defaults() const {
        Params w{};
        for (const FieldRow& f : row().fields()) {
            for (int i = 0; i < f.arity; ++i) w[size_t(f.offset + i)] = f.defaults[size_t(i)];
        }
        return w;
    }
    Edit edit(const Params& w) const {
        Edit e;
        e.name = name();
        e.node.shape.kind = kind();
        e.node.shape.params = w;
        return e;
    }
};
INSTANTIATE_TEST_SUITE_P(Sdf, EachComposite, testing::Range(primitive_count(), int(shape_rows().size())),
                         [](const auto& row) { return std::string(shape_rows()[size_t(row.param)].name); });

TEST_P(EachComposite, IsATreeOfPrimitivesWithoutMaterials) {
    const Object object = composite_object(kind(), defaults());
    EXPECT_EQ(object.name, name());
    ASSERT_GT(object.nodes.size(), 1u);
    for (const Node& node : object.nodes) {
        EXPECT_FALSE(bool(node.material)) << "nodes take the placing edit's material";
        if (node.kind == Node::Kind::Shape) {
            EXPECT_LT(int(node.shape.kind), primitive_count());
        }
    }
}

TEST_P(EachComposite, IsOneLipschitzInsideItsBoundsForAnyParameters) {
    for_all(name(), [&](RandomValues& random) {
        const Params w = random.params(row());
        const Edit e = edit(w);
        const Result<Program> program = compile({{&e, 1}, {}, {}});
        if (!program) RC_FAIL(show(row(), w) + ": " + program.error().message);
        const Box3 box = program->bounds;
        RC_ASSERT(box.finite());
        const double size = double(std::max({box.half_extents().x, box.half_extents().y, box.half_extents().z}));
        for (int i = 0; i < 60; ++i) {
            const Point p = beside(random, {}, 2 * size);
            const Point q = beside(random, p, size * std::pow(10.0, random.in(-4, 0)));
            const double f = evaluate(view(*program), dvec3{p[0], p[1], p[2]});
            const double g = evaluate(view(*program), dvec3{q[0], q[1], q[2]});
            if (std::fabs(f - g) > between(p, q) * (1 + 1e-5) + 3e-6 * size)
                RC_FAIL(show(row(), w) + " " + show(p) + " " + show(q));
            const Box3 wide = box.inflated(float(1e-5 * size));
            if (f <= 0 && !wide.contains({float(p[0]), float(p[1]), float(p[2])}))
                RC_FAIL(show(row(), w) + " solid outside at " + show(p));
        }
    });
}

// Extent of the solid along y, found by walking slices of a grid.
Box3 solid_extent(const Program& program) {
    Box3 out;
    constexpr int kSide = 96;
    const Box3 box = program.bounds;
    std::vector<float> x(kSide * kSide), y(kSide * kSide), z(kSide * kSide), d(kSide * kSide);
    for (int k = 0; k < kSide; ++k) {
        for (int j = 0; j < kSide; ++j) {
            for (int i = 0; i < kSide; ++i) {
                const auto at = size_t(j * kSide + i);
                const auto t = [](int n) { return (float(n) + 0.5f) / kSide; };
                x[at] = box.min.x + (box.max.x - box.min.x) * t(i);
                y[at] = box.min.y + (box.max.y - box.min.y) * t(j);
                z[at] = box.min.z + (box.max.z - box.min.z) * t(k);
            }
        }
        evaluate(view(program), {x.data(), y.data(), z.data(), kSide * kSide}, d.data());
        for (size_t at = 0; at < d.size(); ++at) {
            if (d[at] > 0) continue;
            out.min = min(out.min, {x[at], y[at], z[at]});
            out.max = max(out.max, {x[at], y[at], z[at]});
        }
    }
    return out;
}

TEST_P(EachComposite, HasTheSizeItsRecordPromises) {
    const Edit e = edit(defaults());
    const Result<Program> program = compile({{&e, 1}, {}, {}});
    ASSERT_TRUE(program);
    const Box3 solid = solid_extent(*program);
    const float height = solid.max.y - solid.min.y;
    if (row().fields()[0].name == "length") {
        EXPECT_NEAR(height, defaults()[0], 0.04) << "along +Y";
    } else {
        EXPECT_NEAR(height, 2 * defaults()[0], 2 * defaults()[2]) << "mean radius and relief";
    }
}

TEST_P(EachComposite, GrowsWithItsLength) {
    if (row().fields()[0].name != "length") GTEST_SKIP();
    Params big = defaults();
    big[0] = 3 * big[0];
    const Edit one = edit(defaults()), three = edit(big);
    const Result<Program> a = compile({{&one, 1}, {}, {}}), b = compile({{&three, 1}, {}, {}});
    ASSERT_TRUE(a);
    ASSERT_TRUE(b);
    RandomValues random(1);
    for (int i = 0; i < 500; ++i) {
        const dvec3 p{random.in(-1, 1), random.in(-1, 1), random.in(-1, 1)};
        EXPECT_NEAR(evaluate(view(*b), {3 * p.x, 3 * p.y, 3 * p.z}), 3 * evaluate(view(*a), p), 1e-5);
    }
}

TEST(Planet, StaysWithinItsReliefAndChangesWithTheSeed) {
    double different = 0;
    for (float seed : {0.0f, 1.0f, 12345.0f}) {
        const Edit e = [&] {
            Edit out;
            out.name = "planet";
            out.node.shape = Planet{.radius = 2, .seed = seed, .relief = 0.2f};
            return out;
        }();
        const Result<Program> program = compile({{&e, 1}, {}, {}});
        ASSERT_TRUE(program);
        RandomValues random(3);
        for (int i = 0; i < 2000; ++i) {
            vec3 n = normalize({float(random.in(-1, 1)), float(random.in(-1, 1)), float(random.in(-1, 1))});
            const auto at = [&](float r) {
                return evaluate(view(*program), dvec3{double(n.x * r), double(n.y * r), double(n.z * r)});
            };
            EXPECT_GT(at(2.2f + 1e-4f), 0);
            EXPECT_LT(at(1.8f - 1e-4f), 0);
            if (i == 0) different += at(2) * double(seed + 1);
        }
    }
    EXPECT_NE(different, 0);
}

}  // namespace
}  // namespace kiln::sdf
