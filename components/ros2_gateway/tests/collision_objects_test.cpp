#include "components/ros2_gateway/collision_objects.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/runtime/cell/cell_objects.hpp"
#include "tests/support/hot_cell.hpp"

namespace phantom::ros2_gateway {
namespace {

using testing::HasSubstr;
using Operation = messages::WorkspaceOperation;

CollisionObject box() {
  CollisionObject object;
  object.id = "crate";
  object.frame = "world";
  object.X_FO = {geometry::rotation_from_rpy(0.1, -0.2, 2.0), {0.3, -0.1, 0.2}};
  object.solids.push_back({1, {0.2, 0.1, 0.05}, {}});
  return object;
}

std::string refusal(const CollisionObject& object) {
  const auto commands = commands_of(object, "world");
  return commands ? "" : commands.status().message();
}

TEST(CollisionObjects, AreAddedInPlaceOfTheOnesOfTheirNames) {
  const auto commands = commands_of(box(), "world");
  ASSERT_TRUE(commands) << commands.status().message();
  ASSERT_EQ(commands->size(), 2U);
  EXPECT_EQ((*commands)[0].operation, Operation::kRemove);
  EXPECT_EQ((*commands)[0].object, "crate");
  EXPECT_EQ((*commands)[1].operation, Operation::kAdd);
  EXPECT_THAT((*commands)[1].description,
              HasSubstr("name: \"crate\"\ncsg: {union: [{box: {size_m: [0.2, 0.1, 0.05]}"));
}

// The text is what wva_server reads: the same object comes out, whatever its pose.
TEST(CollisionObjects, AreDescribedAsCellFilesHaveThem) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 300; ++i) {
    CollisionObject object = box();
    Eigen::Vector4d q(unit(random), unit(random), unit(random), unit(random));
    if (i % 10 == 0)
      q = {0.0, std::sqrt(0.5), 0.0, i % 20 == 0 ? std::sqrt(0.5) : -std::sqrt(0.5)};  // pitch of ±90°
    q.normalize();
    object.X_FO = pose_of({unit(random), unit(random), unit(random)}, {q[0], q[1], q[2], q[3]}).value();
    object.solids = {
        {1, {0.2, 0.1, 0.05}, {}}, {2, {0.1}, object.X_FO}, {3, {0.4, 0.1}, {}}, {4, {0.3, 0.2}, {}}};
    const auto commands = commands_of(object, "world");
    ASSERT_TRUE(commands) << commands.status().message();
    const auto read = runtime::read_object_text((*commands)[1].description, test::hot_cell());
    EXPECT_EQ(read.name, "crate");
    EXPECT_LT((read.X_WO.rotation - object.X_FO.rotation).norm(), 1e-7);
    EXPECT_LT((read.X_WO.translation_m - object.X_FO.translation_m).norm(), 1e-8);
  }
}

TEST(CollisionObjects, MoveByTheirPoseAlone) {
  CollisionObject object = box();
  object.operation = CollisionObject::kMove;
  EXPECT_THAT(refusal(object), HasSubstr("MOVE with shapes"));
  object.solids.clear();
  const auto commands = commands_of(object, "world");
  ASSERT_TRUE(commands);
  ASSERT_EQ(commands->size(), 1U);
  EXPECT_EQ(commands->front().operation, Operation::kMove);
  EXPECT_EQ(commands->front().X_WO.translation_m, object.X_FO.translation_m);
  object.operation = CollisionObject::kRemove;
  object.frame = "";
  EXPECT_EQ(commands_of(object, "world")->front().operation, Operation::kRemove);
}

// Tries ros2_gateway: a collision object in another frame
// Tries ros2_gateway: of planes
// Tries ros2_gateway: of shapes that are none
// Tries ros2_gateway: too large for the topic
TEST(CollisionObjects, AreRefusedWithWhatIsAllowed) {
  const auto with = [](auto change) {
    CollisionObject object = box();
    change(object);
    return refusal(object);
  };
  EXPECT_EQ(with([](auto&) {}), "");
  EXPECT_THAT(with([](auto& o) { o.frame = "base_link"; }), HasSubstr("frame 'base_link'; allowed: 'world'"));
  EXPECT_THAT(with([](auto& o) { o.planes = true; }), HasSubstr("plane"));
  EXPECT_THAT(with([](auto& o) { o.operation = CollisionObject::kAppend; }), HasSubstr("allowed: ADD"));
  EXPECT_THAT(with([](auto& o) { o.operation = 77; }), HasSubstr("operation 77"));
  EXPECT_THAT(with([](auto& o) { o.id = ""; }), HasSubstr("an id of 0 bytes"));
  EXPECT_THAT(with([](auto& o) { o.id = "a\"\nmesh: /etc/passwd"; }), HasSubstr("in one line"));
  EXPECT_THAT(with([](auto& o) { o.id = std::string(65, 'x'); }), HasSubstr("65 bytes"));
  EXPECT_THAT(with([](auto& o) { o.solids[0].type = 5; }), HasSubstr("type 5"));
  EXPECT_THAT(with([](auto& o) { o.solids[0].dimensions = {0.1, 0.1}; }), HasSubstr("x, y and z"));
  EXPECT_THAT(with([](auto& o) {
                o.solids[0].dimensions = {0.1, -0.1, 0.1};
              }),
              HasSubstr("[0.1, -0.1, 0.1]"));
  EXPECT_THAT(with([](auto& o) { o.solids[0].dimensions = {0.1, NAN, 0.1}; }), HasSubstr("nan"));
  EXPECT_THAT(with([](auto& o) { o.solids.clear(); }), HasSubstr("no shape"));
  EXPECT_THAT(with([](auto& o) { o.solids.resize(33, o.solids[0]); }), HasSubstr("33 shapes"));
  CollisionObject::Mesh mesh{
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, {}};
  EXPECT_THAT(with([&](auto& o) { o.meshes = {mesh}; }), HasSubstr("a mesh beside other shapes"));
  const auto mesh_alone = [&](auto change) {
    return with([&](auto& o) {
      o.solids.clear();
      o.meshes = {mesh};
      change(o.meshes[0]);
    });
  };
  EXPECT_EQ(mesh_alone([](auto&) {}), "");
  EXPECT_THAT(mesh_alone([](auto& m) { m.triangles[0][1] = 4; }), HasSubstr("vertex 4 of 4"));
  EXPECT_THAT(mesh_alone([](auto& m) { m.vertices_m[0][1] = INFINITY; }), HasSubstr("no number"));
  EXPECT_THAT(mesh_alone([](auto& m) { m.triangles.resize(3); }), HasSubstr("at least 4"));
  EXPECT_THAT(mesh_alone([](auto& m) {
                m.vertices_m.resize(2000, {0.123456789, 0.1, 0.1});
              }),
              HasSubstr("allowed: 16384"));
}

TEST(CollisionObjects, PosesAreChecked) {
  EXPECT_TRUE(pose_of({0, 0, 0}, {0, 0, 0, 0})) << "left unset";
  EXPECT_FALSE(pose_of({0, 0, 0}, {0, 0, 0, 0.9}));
  EXPECT_FALSE(pose_of({0, 0, 0}, {0, 0, NAN, 1}));
  EXPECT_FALSE(pose_of({0, INFINITY, 0}, {0, 0, 0, 1}));
}

}  // namespace
}  // namespace phantom::ros2_gateway
