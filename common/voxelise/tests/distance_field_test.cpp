#include "common/voxelise/distance_field.hpp"

#include <gtest/gtest.h>
#include <zstd.h>

#include <atomic>
#include <cstring>
#include <limits>
#include <random>
#include <utility>

#include "common/geometry/point_triangle.hpp"
#include "common/geometry/primitives.hpp"

namespace phantom::voxelise {
namespace {

using Eigen::Vector3d;
using geometry::Pose;

const workspace::GridSpec kFieldGrid{{-0.5, -0.5, -0.5}, 0.01, {100, 100, 100}};

double mesh_distance(const geometry::TriangleMesh& mesh, const Vector3d& p) {
  double best = 1e30;
  for (const auto& t : mesh.triangles) {
    best = std::min(best, (geometry::closest_point_on_triangle(p, mesh.vertices_m[t[0]].cast<double>(),
                                                               mesh.vertices_m[t[1]].cast<double>(),
                                                               mesh.vertices_m[t[2]].cast<double>()) -
                           p)
                              .norm());
  }
  return best;
}

TEST(DistanceField, IsThatOfASphere) {
  const auto field = DistanceField::build(kFieldGrid, {{geometry::make_sphere(0.2, 5), 3}});
  ASSERT_TRUE(field) << field.status().message();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> coordinate(-0.29, 0.29);
  for (int i = 0; i < 20000; ++i) {
    const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
    const double exact = p.norm() - 0.2;
    if (exact > 0.05 || exact < -0.02) continue;
    EXPECT_NEAR(field->distance_m(p), exact, std::abs(exact) < 0.005 ? 2e-4 : 6e-4) << p.transpose();
    EXPECT_LT((field->gradient(p) - p.normalized()).norm(), 0.12) << p.transpose();
    EXPECT_EQ(field->object(p), 3);
  }
}

TEST(DistanceField, AgreesWithEveryTriangleAtVoxelCentres) {
  const Pose X_WO{geometry::rotation_from_rpy(0.4, 0.7, -0.3), {0.05, -0.03, 0.02}};
  const auto mesh = geometry::make_box({0.31, 0.17, 0.23}).transformed(X_WO);
  const auto field = DistanceField::build(kFieldGrid, {{mesh, 1}});
  ASSERT_TRUE(field);
  std::mt19937 random(2);
  int compared = 0;
  for (int i = 0; i < 20000; ++i) {
    const workspace::Index3 v{static_cast<int>(random() % 100), static_cast<int>(random() % 100),
                              static_cast<int>(random() % 100)};
    const Vector3d p = kFieldGrid.centre_of(v);
    const Vector3d local = X_WO.inverse() * p;
    const bool inside =
        std::abs(local.x()) < 0.155 && std::abs(local.y()) < 0.085 && std::abs(local.z()) < 0.115;
    const double exact = (inside ? -1 : 1) * mesh_distance(mesh, p);
    const double expected = std::clamp(exact, -0.03, 0.06);
    EXPECT_NEAR(field->distance_m(p), expected, 2e-5) << p.transpose();
    compared += std::abs(exact) < 0.05 ? 1 : 0;
  }
  EXPECT_GT(compared, 500);
}

TEST(DistanceField, OfManyBodiesIsThatOfTheNearest) {
  const auto left = geometry::make_sphere(0.1, 4).transformed({Eigen::Matrix3d::Identity(), {-0.12, 0, 0}});
  const auto right = geometry::make_sphere(0.1, 4).transformed({Eigen::Matrix3d::Identity(), {0.12, 0, 0}});
  const auto field = DistanceField::build(kFieldGrid, {{left, 1}, {right, 2}});
  ASSERT_TRUE(field);
  EXPECT_NEAR(field->distance_m({-0.005, 0.0, 0.0}), 0.015, 6e-4);
  EXPECT_EQ(field->object({-0.015, 0.002, 0.002}), 1);
  EXPECT_EQ(field->object({0.015, 0.002, 0.002}), 2);
}

TEST(DistanceField, SaysFreeOutOfTheBandAndDeepInTheBody) {
  const auto field = DistanceField::build(kFieldGrid, {{geometry::make_box({0.4, 0.4, 0.4}), 1}});
  ASSERT_TRUE(field);
  EXPECT_DOUBLE_EQ(field->distance_m({0, 0, 0}), -0.03);
  EXPECT_EQ(field->gradient({0, 0, 0}), Vector3d::Zero());
  EXPECT_DOUBLE_EQ(field->distance_m({0.45, 0.45, 0.45}), 0.06);
  EXPECT_DOUBLE_EQ(field->distance_m({9, 9, 9}), 0.06);
  EXPECT_DOUBLE_EQ(field->distance_m({std::nan(""), 0, 0}), 0.06);
  EXPECT_EQ(field->object({9, 9, 9}), 0);
  EXPECT_LT(field->bytes(), 100U * 100U * 100U * 4U);
}

TEST(DistanceField, GradientIsTheSlopeOfTheDistance) {
  const auto field = DistanceField::build(kFieldGrid, {{geometry::make_torus(0.2, 0.07), 1}});
  ASSERT_TRUE(field);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> coordinate(-0.3, 0.3);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
    const double h = 1e-7;
    Vector3d difference;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = h * Vector3d::Unit(axis);
      difference[axis] = (field->distance_m(p + step) - field->distance_m(p - step)) / (2 * h);
    }
    EXPECT_LT((field->gradient(p) - difference).norm(), 1e-5);
  }
}

// A process that is told to end may be far into a field that takes seconds.
TEST(DistanceField, EndsSoonWhereverItIsToldTo) {
  const std::vector<FieldBody> bodies{{geometry::make_sphere(0.2, 5), 1},
                                      {geometry::make_box({0.5, 0.5, 0.5}), 2},
                                      {geometry::make_torus(0.2, 0.07), 3}};
  const auto build = [&bodies](int most) {  // gives up when it has been asked so often
    std::atomic<int> asked{0};
    DistanceFieldOptions options;
    options.keep_going = [&] { return ++asked <= most; };
    const auto field = DistanceField::build(kFieldGrid, bodies, options);
    EXPECT_TRUE(field || field.status().code() == core::ErrorCode::kUnavailable) << field.status().message();
    return std::pair(field.has_value(), asked.load());
  };
  const auto [whole, times] = build(std::numeric_limits<int>::max());
  EXPECT_TRUE(whole);
  EXPECT_GT(times, 100);  // for some 0.2 s of work
  for (int most = 0; most < times; most += 1 + times / 8) {
    const auto [done, asked] = build(most);
    EXPECT_FALSE(done) << most;
    // Once each for those that work at that moment, and each body that was begun.
    EXPECT_LE(asked, most + 1 + static_cast<int>(bodies.size()) * 2) << most;
  }
}

TEST(DistanceField, RefusesWhatItCannotHold) {
  const auto sphere = geometry::make_sphere(0.2, 2);
  EXPECT_FALSE(DistanceField::build(kFieldGrid, {{sphere, 1}}, {.outside_m = 0.0}));
  EXPECT_FALSE(DistanceField::build(kFieldGrid, {{sphere, 1}}, {.outside_m = 0.7}));
  const auto huge = geometry::make_sphere(1e4, 2);
  const auto refused = DistanceField::build(kFieldGrid, {{huge, 5}});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.status().message().find("body 5"), std::string::npos);
}

TEST(DistanceField, IsTheSameAfterItWasEncoded) {
  const Pose X_WO{geometry::rotation_from_rpy(0.4, 0.7, -0.3), {0.05, -0.03, 0.02}};
  const auto field = DistanceField::build(
      kFieldGrid,
      {{geometry::make_sphere(0.2, 4), 3}, {geometry::make_box({0.3, 0.2, 0.5}).transformed(X_WO), 4}});
  ASSERT_TRUE(field);
  const auto back = DistanceField::decode(field->encode());
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->bytes(), field->bytes());
  EXPECT_EQ(back->outside_m(), field->outside_m());
  EXPECT_EQ(back->inside_m(), field->inside_m());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-0.55, 0.55);
  for (int i = 0; i < 20000; ++i) {
    const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
    EXPECT_EQ(back->distance_m(p), field->distance_m(p));
    EXPECT_EQ(back->gradient(p), field->gradient(p));
    EXPECT_EQ(back->object(p), field->object(p));
  }
}

TEST(DistanceField, RefusesWhatIsNotWhole) {
  const auto field =
      DistanceField::build(kFieldGrid, {{geometry::make_sphere(0.1, 3), 3}}, {.outside_m = 0.02});
  ASSERT_TRUE(field);
  const auto whole = field->encode();
  std::mt19937 random(4);
  for (int i = 0; i < 200; ++i) {
    const std::size_t at = random() % whole.size();
    EXPECT_FALSE(DistanceField::decode(std::span(whole).first(at))) << at;
    auto damaged = whole;
    damaged[at] ^= static_cast<std::uint8_t>(1U << random() % 8);
    const auto found = DistanceField::decode(damaged);
    EXPECT_TRUE(!found || found->encode() == whole) << "bit of byte " << at;
  }
  EXPECT_FALSE(DistanceField::decode({}));
}

// What has a fitting checksum and yet is none: made by another program.
TEST(DistanceField, RefusesAFrameThatWouldLeadOutOfItsMemory) {
  const auto field =
      DistanceField::build(kFieldGrid, {{geometry::make_sphere(0.1, 3), 3}}, {.outside_m = 0.02});
  ASSERT_TRUE(field);
  const auto frame = field->encode();
  std::vector<std::uint8_t> plain(ZSTD_getFrameContentSize(frame.data(), frame.size()));
  ASSERT_EQ(ZSTD_decompress(plain.data(), plain.size(), frame.data(), frame.size()), plain.size());
  const auto decodes = [](const std::vector<std::uint8_t>& bytes) {
    std::vector<std::uint8_t> packed(ZSTD_compressBound(bytes.size()));
    packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
    return DistanceField::decode(packed).has_value();
  };
  EXPECT_TRUE(decodes(plain));
  // In the header each: magic, voxel size, bands, size of the grid, number of cubes; behind it the directory.
  for (const std::size_t at : {0U, 39U, 47U, 55U, 63U, 64U, 67U, 76U, 79U}) {
    auto changed = plain;
    changed[at] ^= 0x80U;
    EXPECT_FALSE(decodes(changed)) << at;
  }
  for (const std::int32_t cube : {-3, 1 << 30, std::numeric_limits<std::int32_t>::min()}) {
    auto changed = plain;
    std::memcpy(changed.data() + 80 + 4 * 500, &cube, sizeof cube);
    EXPECT_FALSE(decodes(changed)) << cube;
  }
  plain.push_back(0);
  EXPECT_FALSE(decodes(plain));
}

}  // namespace
}  // namespace phantom::voxelise
