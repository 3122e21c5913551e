// Arms as others describe them: what hangs on joints off the chain, and links of boxes, cylinders and
// spheres.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <urdf_parser/urdf_parser.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/mesh/stl.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "tests/support/files.hpp"

namespace phantom::robot {
namespace {

using core::JointArray;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::string kMimic = R"(<mimic joint="left" multiplier="-0.5" offset="0.03"/>)";

/// Two revolute joints and a hand with slanted fingers: `right` mimics `left`, a thumb turns on `left`'s
/// finger, and a wheel turns on the base.
std::string hand(const std::string& mimic = kMimic) {
  const auto fingertip = [](const std::string& joint) {
    return joint.substr(0, joint.size() - std::string("</joint>").size());
  };
  return test_arms::link("base", 3, "0 0 0.1") + test_arms::link("upper", 2, "0.2 0.01 0") +
         test_arms::link("palm", 1, "0.1 0 0.02") + test_arms::link("left_finger", 0.3, "0.01 0.02 0.03") +
         test_arms::link("right_finger", 0.4, "-0.01 0.02 0.05") + test_arms::link("nail", 0.1, "0 0 0.01") +
         test_arms::link("thumb", 0.2, "0.03 0 0") + test_arms::link("wheel", 0.7, "0 0.1 0") +
         test_arms::moving_joint("shoulder", "revolute", "base", "upper", "0 0 0.3", "0.1 0 0", "0 1 0.2",
                                 2) +
         test_arms::moving_joint("elbow", "revolute", "upper", "palm", "0.4 0 0", "0 0 0.3", "0 0 1", 2) +
         test_arms::moving_joint("left", "prismatic", "palm", "left_finger", "0.1 0.02 0", "0.3 0.1 0",
                                 "0 2 1", 0.08) +
         fingertip(test_arms::moving_joint("right", "prismatic", "palm", "right_finger", "0.1 -0.02 0",
                                           "0 0.1 0.4", "1 -2 0", 0.09)) +
         mimic + "</joint>" +
         test_arms::moving_joint("thumb_joint", "revolute", "left_finger", "thumb", "0 0 0.05", "0 0.2 0",
                                 "1 0 1", 1) +
         R"(<joint name="glue" type="fixed"><parent link="right_finger"/><child link="nail"/>
              <origin xyz="0 0 0.06" rpy="0.5 0 0"/></joint>
            <joint name="axle" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 1 0"/></joint>)";
}

SerialArm load_held(const std::string& body, const std::string& tip,
                    const std::map<std::string, double>& held) {
  auto arm = SerialArm::from_urdf(test_arms::write_urdf(body), tip, test_arms::at(0.1, 0.2, 0.3), held);
  if (!arm) throw std::runtime_error(arm.status().message());
  return *std::move(arm);
}

geometry::Pose frame_W(const SerialArm& arm, const std::string& name, const JointArray& q) {
  LinkPoses X_WL;
  arm.link_poses(q, X_WL);
  const auto [link, X_link_frame] = *arm.find_frame(name);
  return X_WL[link] * X_link_frame;
}

void expect_same(const geometry::Pose& a, const geometry::Pose& b) {
  EXPECT_LT((a.rotation - b.rotation).norm(), 1e-12);
  EXPECT_LT((a.translation_m - b.translation_m).norm(), 1e-12);
}

/// Held joints against the same joints in the chain, where they move: frames, and the weight on the arm.
TEST(HeldJoints, AreWhereTheyWouldBeInTheChain) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> slide(-0.08, 0.08), turn(-1.0, 1.0), any(-2.0, 2.0);
  for (int trial = 0; trial < 30; ++trial) {
    const double left = slide(random), thumb = turn(random), axle = 4 * any(random);
    const double right = -0.5 * left + 0.03;
    const SerialArm held =
        load_held(hand(), "palm", {{"left", left}, {"thumb_joint", thumb}, {"axle", axle}});
    const SerialArm to_thumb = load_held(hand(""), "thumb", {{"right", right}, {"axle", axle}});
    const SerialArm to_nail =
        load_held(hand(""), "nail", {{"left", left}, {"thumb_joint", thumb}, {"axle", axle}});
    ASSERT_EQ(held.joint_count(), 2U);
    ASSERT_EQ(to_thumb.joint_count(), 4U);
    ASSERT_EQ(to_nail.joint_count(), 3U);
    const double shoulder = any(random), elbow = any(random);
    const JointArray q{shoulder, elbow}, q_thumb{shoulder, elbow, left, thumb},
        q_nail{shoulder, elbow, right};
    for (const char* frame : {"palm", "left_finger", "thumb", "wheel", "right_finger", "nail"}) {
      SCOPED_TRACE(frame);
      expect_same(frame_W(held, frame, q), frame_W(to_thumb, frame, q_thumb));
      expect_same(frame_W(held, frame, q), frame_W(to_nail, frame, q_nail));
    }
    LinkPoses X_WL, X_thumb;
    held.link_poses(q, X_WL);
    to_thumb.link_poses(q_thumb, X_thumb);
    const JointArray weight = held.gravity_torque(X_WL), expected = to_thumb.gravity_torque(X_thumb);
    for (std::size_t j = 0; j < held.joint_count(); ++j) EXPECT_NEAR(weight[j], expected[j], 1e-12);
    EXPECT_NEAR(held.links()[2].mass_kg, 1 + 0.3 + 0.4 + 0.1 + 0.2, 1e-12);
    EXPECT_NEAR(held.links()[0].mass_kg, 3.7, 1e-12);
  }
}

std::string branch(const std::string& type, const std::string& inner) {
  return test_arms::link("base", 0, "0 0 0") + test_arms::link("tip", 0, "0 0 0") +
         test_arms::link("finger", 0.1, "0 0 0") +
         test_arms::moving_joint("turn", "revolute", "base", "tip", "0 0 0", "0 0 0", "0 0 1", 1) +
         R"(<joint name="slide" type=")" + type + R"("><parent link="tip"/><child link="finger"/>
         <origin xyz="0 0 0.5"/><axis xyz="0 0 1"/>)" +
         inner + "</joint>";
}
std::string limit(const std::string& lower, const std::string& upper) {
  return R"(<limit lower=")" + lower + R"(" upper=")" + upper + R"(" velocity="0" effort="0"/>)";
}
double finger_z(const SerialArm& arm) { return arm.find_frame("finger")->second.translation_m.z(); }

TEST(HeldJoints, StandAtZeroOrTheLimitNearestToItUnlessStated) {
  EXPECT_DOUBLE_EQ(finger_z(load_held(branch("prismatic", limit("-1", "1")), "tip", {})), 0.5);
  EXPECT_DOUBLE_EQ(finger_z(load_held(branch("prismatic", limit("0.01", "0.04")), "tip", {})), 0.51);
  EXPECT_DOUBLE_EQ(finger_z(load_held(branch("prismatic", limit("-0.04", "-0.02")), "tip", {})), 0.48);
  EXPECT_DOUBLE_EQ(finger_z(load_held(branch("prismatic", limit("0", "0.04")), "tip", {{"slide", 0.04}})),
                   0.54);
  const SerialArm floating = load_held(branch("floating", ""), "tip", {});
  EXPECT_DOUBLE_EQ(finger_z(floating), 0.5);
  EXPECT_THAT(floating.notices(), ElementsAre("joints off the chain are held: slide at its origin"));
}

TEST(HeldJoints, AreReported) {
  EXPECT_THAT(
      load_held(hand(), "palm", {{"left", 0.02}}).notices(),
      ElementsAre("joints off the chain are held: axle at 0 rad, left at 0.02 m, thumb_joint at 0 rad, "
                  "right at 0.02 m (as left)"));
  EXPECT_THAT(load_held(hand(R"(<mimic joint="left" multiplier="2"/>)"), "palm", {{"left", 0.05}}).notices(),
              ElementsAre(HasSubstr("right at 0.1 m (as left, beyond its own limits)")));
  EXPECT_THAT(test_arms::planar().notices(), IsEmpty());
}

TEST(HeldJoints, MimicByWayOfAnother) {
  const std::string third =
      test_arms::link("third", 0, "0 0 0") +
      R"(<joint name="third_joint" type="prismatic"><parent link="palm"/><child link="third"/>
         <axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="1" effort="1"/><mimic joint="right" multiplier="2"/></joint>)";
  const SerialArm arm = load_held(hand() + third, "palm", {{"left", 0.02}});
  EXPECT_NEAR(arm.find_frame("third")->second.translation_m.x(), 2 * (-0.5 * 0.02 + 0.03), 1e-15);
}

std::string refusal(const std::string& body, const std::string& tip,
                    const std::map<std::string, double>& held = {}) {
  const auto arm = SerialArm::from_urdf(test_arms::write_urdf(body), tip, {}, held);
  EXPECT_FALSE(arm.has_value());
  return arm.status().message();
}

TEST(HeldJointsRefuse, WhatCannotBeStated) {
  EXPECT_THAT(refusal(hand(), "palm", {{"lefty", 0.0}}),
              HasSubstr("held_joints: 'lefty' is no joint of the file; allowed: axle, left, thumb_joint"));
  EXPECT_THAT(refusal(hand(), "palm", {{"elbow", 0.0}}),
              HasSubstr("'elbow' is a joint of the chain, which moves"));
  EXPECT_THAT(refusal(hand(), "palm", {{"right", 0.0}}),
              HasSubstr("'right' mimics left; allowed: axle, left"));
  EXPECT_THAT(refusal(hand(), "palm", {{"glue", 0.0}}), HasSubstr("'glue' neither turns nor slides"));
  EXPECT_THAT(refusal(hand(""), "nail", {{"glue", 0.0}}), HasSubstr("'glue' neither turns nor slides"));
  EXPECT_THAT(refusal(hand(), "palm", {{"left", 0.09}}),
              HasSubstr("held_joints: 0.09 for 'left' is outside of its limits; allowed: -0.08 to 0.08"));
  EXPECT_THAT(refusal(hand(), "palm", {{"left", std::nan("")}}), HasSubstr("outside of its limits"));
  EXPECT_THAT(refusal(branch("floating", ""), "tip", {{"slide", 0.0}}),
              HasSubstr("neither turns nor slides; allowed: none, no joint is held"));
  EXPECT_THAT(refusal(branch("prismatic", limit("1", "-1")), "tip"), HasSubstr("'slide': limit lower"));
}

TEST(HeldJointsRefuse, AMimicThatCannotBeFollowed) {
  EXPECT_THAT(refusal(hand(R"(<mimic joint="elbow"/>)"), "palm"),
              HasSubstr("joint 'right' mimics 'elbow', which moves"));
  EXPECT_THAT(refusal(hand(R"(<mimic joint="none"/>)"), "palm"),
              HasSubstr("'none', which is not in the file"));
  EXPECT_THAT(refusal(hand(R"(<mimic joint="right"/>)"), "palm"), HasSubstr("mimics itself"));
  EXPECT_THAT(refusal(hand(R"(<mimic joint="left" multiplier="1e400"/>)"), "palm"),
              HasSubstr("multiplier value (1e400) is not a valid float"));
  EXPECT_THAT(refusal(hand(), "right_finger"), HasSubstr("joint 'right' mimics another; every moving joint"));
}

// ---- what is seen

const std::string kInertial =
    R"(<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>)";

SerialArm look(const std::string& inside_of_tip) {
  return test_arms::load(
      R"(<link name="base"/><link name="tip">)" + kInertial + inside_of_tip + "</link>" +
          test_arms::moving_joint("turn", "revolute", "base", "tip", "0 0 0", "0 0 0", "0 0 1", 1),
      "tip");
}
std::string piece(const std::string& kind, const std::string& shape,
                  const std::string& origin = R"(xyz="0 0 0")") {
  return "<" + kind + "><origin " + origin + "/><geometry>" + shape + "</geometry></" + kind + ">";
}
geometry::TriangleMesh only_mesh(const SerialArm& arm) {
  EXPECT_EQ(arm.links()[1].meshes.size(), 1U);
  return load_mesh(arm.links()[1].meshes.at(0)).value().transformed(arm.links()[1].meshes[0].X_link_mesh);
}
void expect_box(const geometry::TriangleMesh& mesh, const Eigen::Vector3d& least, const Eigen::Vector3d& most,
                double near) {
  const geometry::BoundingBox box = mesh.bounding_box();
  EXPECT_LT((box.min_m.cast<double>() - least).cwiseAbs().maxCoeff(), near);
  EXPECT_LT((box.max_m.cast<double>() - most).cwiseAbs().maxCoeff(), near);
}

TEST(Primitives, HaveTheSizeThatTheFileStates) {
  const double quarter = std::numbers::pi / 2;
  const auto box = only_mesh(look(piece("visual", R"(<box size="0.2 0.4 0.6"/>)",
                                        "xyz=\"1 2 3\" rpy=\"0 0 " + std::to_string(quarter) + "\"")));
  EXPECT_NEAR(geometry::enclosed_volume_m3(box), 0.2 * 0.4 * 0.6, 1e-7);
  expect_box(box, {0.8, 1.9, 2.7}, {1.2, 2.1, 3.3}, 1e-6);

  const auto cylinder =
      only_mesh(look(piece("visual", R"(<cylinder radius="0.1" length="0.5"/>)", R"(xyz="0 0 1")")));
  // A prism with 48 corners on the circle.
  const double prism_m2 = 24 * 0.1 * 0.1 * std::sin(2 * std::numbers::pi / 48);
  EXPECT_NEAR(geometry::enclosed_volume_m3(cylinder), prism_m2 * 0.5, 1e-8);
  EXPECT_NEAR(geometry::enclosed_volume_m3(cylinder), std::numbers::pi * 0.01 * 0.5, 5e-5);
  expect_box(cylinder, {-0.1, -0.1, 0.75}, {0.1, 0.1, 1.25}, 1e-6);

  const auto sphere = only_mesh(look(piece("visual", R"(<sphere radius="0.3"/>)", R"(xyz="-1 0 0")")));
  const double ball_m3 = 4.0 / 3.0 * std::numbers::pi * 0.027;
  EXPECT_NEAR(geometry::enclosed_volume_m3(sphere), ball_m3, 0.005 * ball_m3);
  EXPECT_LT(geometry::enclosed_volume_m3(sphere), ball_m3) << "its corners lie on the sphere";
  expect_box(sphere, {-1.3, -0.3, -0.3}, {-0.7, 0.3, 0.3}, 1e-3);
}

TEST(Primitives, KeepTheColourAndEveryPiece) {
  const SerialArm arm = look(
      R"(<visual><geometry><box size="1 1 1"/></geometry><material name="red"><color rgba="0.9 0.1 0.2 1"/>
              </material></visual>)" +
      piece("visual", R"(<sphere radius="0.1"/>)") + piece("collision", R"(<box size="2 2 2"/>)"));
  ASSERT_EQ(arm.links()[1].meshes.size(), 2U) << "the collision geometry does not stand beside visuals";
  EXPECT_EQ(arm.links()[1].meshes[0].colour, (std::array<float, 3>{0.9F, 0.1F, 0.2F}));
  EXPECT_THAT(arm.notices(), IsEmpty());
}

TEST(Primitives, CollisionGeometryStandsInForVisuals) {
  const SerialArm arm = look(piece("collision", R"(<box size="0.1 0.2 0.3"/>)", R"(xyz="0 0 1")"));
  expect_box(only_mesh(arm), {-0.05, -0.1, 0.85}, {0.05, 0.1, 1.15}, 1e-6);
  EXPECT_THAT(arm.notices(), ElementsAre("link 'tip' has no visual; its collision geometry stands for it"));
}

TEST(Primitives, OneWithoutExtentIsLeftOutAloud) {
  const SerialArm arm = look(piece("visual", R"(<box size="0.1 0 0.3"/>)"));
  EXPECT_TRUE(arm.links()[1].meshes.empty());
  EXPECT_THAT(arm.notices(), ElementsAre("link 'tip': geometry with a length of 0 is left out"));
}

TEST(Primitives, ImpossibleLengthsAreRefused) {
  const auto load = [](const std::string& shape) {
    return refusal(
        R"(<link name="base">)" + piece("visual", shape) + R"(</link><link name="tip"/>)" +
            test_arms::moving_joint("turn", "revolute", "base", "tip", "0 0 0", "0 0 0", "0 0 1", 1),
        "tip");
  };
  EXPECT_THAT(load(R"(<sphere radius="-0.1"/>)"), HasSubstr("link 'base': lengths of its geometry must be"));
  EXPECT_THAT(load(R"(<cylinder radius="0.1" length="-1"/>)"), HasSubstr("link 'base': lengths"));
  EXPECT_THAT(load(R"(<box size="0.1 1e30 1"/>)"), HasSubstr("must be from 0 to 10000 m"));
  EXPECT_THAT(load(R"(<box size="0.1 -1 1"/>)"), HasSubstr("link 'base': lengths"));
  EXPECT_THAT(load(R"(<cylinder radius="x" length="1"/>)"), HasSubstr("not a usable URDF: radius"));
  EXPECT_THAT(load(R"(<capsule radius="1" length="1"/>)"),
              HasSubstr("not a usable URDF: Unknown geometry type 'capsule'"));
}

class MeshFile : public testing::Test {
 protected:
  static void write(const std::filesystem::path& file, const geometry::TriangleMesh& mesh) {
    std::filesystem::create_directories(file.parent_path());
    const auto bytes = geometry::binary_stl(mesh);
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  /// The arm's URDF in `folder`, with one visual.
  static core::Expected<SerialArm> load(const std::filesystem::path& folder, const std::string& mesh) {
    std::filesystem::create_directories(folder);
    const auto file = folder / "arm.urdf";
    std::ofstream(file) << R"(<robot name="arm"><link name="base"/><link name="tip">)" << kInertial
                        << piece("visual", mesh) << "</link>"
                        << test_arms::moving_joint("turn", "revolute", "base", "tip", "0 0 0", "0 0 0",
                                                   "0 0 1", 1)
                        << "</robot>";
    return SerialArm::from_urdf(file, "tip", {});
  }
  const std::filesystem::path folder_ = test::new_folder();
};

TEST_F(MeshFile, IsScaledAlongEachAxisAndMirrored) {
  geometry::TriangleMesh wedge = geometry::make_prism({{{0, 0}, {2, 0}, {0, 1}}}, 3);
  write(folder_ / "wedge.stl", wedge);
  const auto arm = load(folder_, R"(<mesh filename="wedge.stl" scale="-0.5 2 0.1"/>)");
  ASSERT_TRUE(arm) << arm.status().message();
  const auto mesh = only_mesh(*arm);
  expect_box(mesh, {-1, 0, -0.15}, {0, 2, 0.15}, 1e-6);
  EXPECT_NEAR(geometry::enclosed_volume_m3(mesh), 3 * 0.1, 1e-6) << "still outward";
  for (const char* scale : {"0 1 1", "1 1 inf"}) {
    const auto refused =
        load(folder_, R"(<mesh filename="wedge.stl" scale=")" + std::string(scale) + R"("/>)");
    ASSERT_FALSE(refused) << scale;
    EXPECT_THAT(refused.status().message(),
                testing::AnyOf(HasSubstr("scale must be three finite numbers, none of them 0"),
                               HasSubstr("Mesh scale was specified, but could not be parsed")));
  }
}

TEST_F(MeshFile, IsFoundInItsPackageAboveAndInOneBeside) {
  write(folder_ / "arm_description/meshes/link.stl", geometry::make_box({1, 1, 1}));
  write(folder_ / "gripper_description/finger.stl", geometry::make_box({1, 1, 2}));
  const auto place = folder_ / "arm_description/robots/model";
  for (const char* name : {"package://arm_description/meshes/link.stl",
                           "package://gripper_description/finger.stl", "../../meshes/link.stl"}) {
    const auto arm = load(place, R"(<mesh filename=")" + std::string(name) + R"("/>)");
    ASSERT_TRUE(arm) << arm.status().message();
    EXPECT_GT(geometry::enclosed_volume_m3(only_mesh(*arm)), 0.9) << name;
  }
  // As the arm's and the gripper's packages may have files of one name, the one in its own package comes
  // first.
  write(folder_ / "gripper_description/meshes/link.stl", geometry::make_box({1, 1, 3}));
  const auto own = load(place, R"(<mesh filename="package://gripper_description/meshes/link.stl"/>)");
  ASSERT_TRUE(own) << own.status().message();
  EXPECT_NEAR(geometry::enclosed_volume_m3(only_mesh(*own)), 3, 1e-5);
  EXPECT_THAT(own->notices(), IsEmpty());
  const auto renamed = load(place, R"(<mesh filename="package://arm_model/meshes/link.stl"/>)");
  ASSERT_TRUE(renamed) << renamed.status().message();
  EXPECT_THAT(renamed->notices(),
              ElementsAre(testing::EndsWith("link.stl is taken from " +
                                            (folder_ / "arm_description/meshes/link.stl").string())));
  const auto missing = load(place, R"(<mesh filename="package://arm_description/meshes/none.stl"/>)");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.status().code(), core::ErrorCode::kNotFound);
  EXPECT_THAT(missing.status().message(), HasSubstr("and in the folders above"));
}

TEST_F(MeshFile, OfColladaIsInTheUnitThatItDeclares) {
  std::ofstream(folder_ / "box.dae") << R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="inch" meter="0.0254"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0 10 0 0 0 20 0 0 0 30</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
  const auto arm = load(folder_, R"(<mesh filename="box.dae" scale="2 2 2"/>)");
  ASSERT_TRUE(arm) << arm.status().message();
  expect_box(only_mesh(*arm), {0, 0, 0}, {0.508, 1.016, 1.524}, 1e-5);
}

// ---- what is noted

/// Two joints, with additions to the second link and joint.
std::string two_joints(
    const std::string& link, const std::string& joint = "",
    const std::string& limit = R"(<limit lower="-1" upper="1" velocity="1" effort="1"/>)") {
  return R"(<link name="base"/>)" + test_arms::link("l1", 1, "0 0 0") + R"(<link name="l2">)" + link +
         "</link>" + test_arms::moving_joint("j1", "revolute", "base", "l1", "0 0 0", "0 0 0", "0 0 1", 1) +
         R"(<joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/>)" + limit + joint +
         "</joint>";
}
std::string inertia(const std::string& ixx, const std::string& izz, const std::string& mass = "2") {
  return R"(<inertial><mass value=")" + mass + R"("/><inertia ixx=")" + ixx + R"(" ixy="0" ixz="0" iyy=")" +
         ixx + R"(" iyz="0" izz=")" + izz + R"("/></inertial>)";
}
std::vector<std::string> notices_of(const std::string& body) { return test_arms::load(body, "l2").notices(); }

TEST(Notices, NameMissingMass) {
  EXPECT_THAT(notices_of(two_joints(inertia("0.01", "0.01"))), IsEmpty());
  EXPECT_THAT(notices_of(two_joints("")), ElementsAre("links without mass (<inertial>): 'l2'"));
  EXPECT_THAT(
      notices_of(R"(<link name="base"/><link name="l2"/>)" +
                 test_arms::moving_joint("j", "revolute", "base", "l2", "0 0 0", "0 0 0", "0 0 1", 1)),
      ElementsAre(HasSubstr("no moving link has a mass (<inertial>)")));
}

TEST(Notices, NameInertiasThatNoLinkHas) {
  EXPECT_THAT(notices_of(two_joints(inertia("0.01", "0.0201"))), IsEmpty()) << "rounded";
  EXPECT_THAT(
      notices_of(two_joints(inertia("0.01", "9"))),
      ElementsAre("link 'l2': no body has its inertia, of the principal moments 0.01, 0.01, 9 kg·m²: the "
                  "greatest may not exceed the sum of the others"));
  EXPECT_THAT(notices_of(two_joints(inertia("1e7", "1e7", "2000"))),
              ElementsAre(AllOf(HasSubstr("link 'l2': its inertia, 1e+07, 1e+07, 1e+07 kg·m²"),
                                HasSubstr("70.7107 m from its middle: a URDF is in kg and m"))));
  EXPECT_THAT(refusal(two_joints(inertia("-1", "1")), "l2"), HasSubstr("link 'l2': inertia must be finite"));
}

TEST(Notices, NameLimitsThatAreNotApplied) {
  const auto soft = [](const std::string& lower, const std::string& upper) {
    return two_joints(inertia("1", "1"),
                      R"(<safety_controller k_position="1" k_velocity="1" soft_lower_limit=")" + lower +
                          R"(" soft_upper_limit=")" + upper + R"("/>)");
  };
  EXPECT_THAT(
      notices_of(soft("-0.1", "0.2")),
      ElementsAre(
          "joint 'j2': the soft limits of its <safety_controller>, -0.1 to "
          "0.2, are not applied; its range is -1 to 1 (lower_limits and upper_limits of the arm's file may state "
          "them)"));
  EXPECT_THAT(notices_of(soft("-1", "1")), IsEmpty());
  EXPECT_THAT(notices_of(soft("0", "0")), IsEmpty());
  EXPECT_THAT(notices_of(two_joints(inertia("1", "1"), "",
                                    R"(<limit lower="-180" upper="180" velocity="90" effort="1"/>)")),
              ElementsAre(AllOf(HasSubstr("joint 'j2': its range, -180 to 180 rad"),
                                HasSubstr("a URDF is in radians, not in degrees"))));
}

TEST(UrdfRefuses, InWordsThatNameLinkOrJoint) {
  EXPECT_THAT(refusal(two_joints(piece("visual", R"(<capsule radius="1" length="1"/>)")), "l2"),
              AllOf(HasSubstr("Unknown geometry type 'capsule'"), HasSubstr("l2")));
  EXPECT_THAT(refusal(two_joints("", R"(<origin xyz="0 0 0,4"/>)"), "l2"),
              AllOf(HasSubstr("0,4"), HasSubstr("j2")));
  EXPECT_THAT(refusal(two_joints("", R"(<origin xyz="0 0 40cm"/>)"), "l2"),
              AllOf(HasSubstr("40cm"), HasSubstr("j2")));
}

TEST(UrdfRefuses, XacroThatIsNotExpanded) {
  const std::string expanded = "needed is what xacro makes of the file: xacro FILE > arm.urdf";
  EXPECT_THAT(
      refusal("\n<xacro:property name='h' value='1'/>\n" + two_joints("", R"(<origin xyz="0 0 ${h}"/>)"),
              "l2"),
      AllOf(HasSubstr("j2"), HasSubstr("line 3 has '<xacro:property' of xacro"), HasSubstr(expanded)));
  EXPECT_THAT(refusal(two_joints("", R"(<origin xyz="0 0 ${h * 2}"/>)"), "l2"),
              AllOf(HasSubstr("line 2 has '${h * 2}' of xacro"), HasSubstr(expanded)));
  EXPECT_THAT(refusal(two_joints("") + "<xacro:if value='1'><link name='x'/></xacro:if>", "l2"),
              HasSubstr("line 2 has '<xacro:if' of xacro"));
  EXPECT_THAT(refusal(two_joints(piece("visual", R"(<mesh filename="file://$(find arm)/x.stl"/>)")), "l2"),
              AllOf(HasSubstr("link 'l2': mesh "), HasSubstr("xacro that has not been expanded")));
  // What xacro writes itself, and what other programs expand.
  EXPECT_THAT(notices_of("<!-- made by <xacro:robot> from ${file} -->" + two_joints(inertia("1", "1")) +
                         "<gazebo><plugin>$(env HOME) ${x}</plugin></gazebo>"),
              IsEmpty());
}

TEST(UrdfRefuses, MeshNamesThatAreNoPaths) {
  const auto with = [](const std::string& name) {
    return refusal(two_joints(piece("visual", "<mesh filename=\"" + name + "\"/>")), "l2");
  };
  EXPECT_THAT(with("https://example.org/x.stl"),
              HasSubstr("'https' is not read: allowed are package://, file://"));
  EXPECT_THAT(with("model://arm/x.stl"), HasSubstr("'model' is not read"));
  EXPECT_THAT(with(R"(package://arm\meshes\x.stl)"), HasSubstr(R"(it has '\' where a URDF has '/')"));
}

/// Bytes of a whole file, damaged at random: an arm of finite numbers comes out, or one message.
TEST(ForeignUrdf, DamagedFilesAreReadOrRefused) {
  const std::string whole = test::text_of(PHANTOM_SOURCE_DIR "/deploy/arms/laboratory_arm.urdf");
  const std::string often = "0123456789.-eE\"<>/= xyzinfan";
  std::mt19937 random(5);
  const auto below = [&random](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  const auto file = test::new_folder() / "damaged.urdf";
  std::size_t read = 0, refused = 0;
  for (int trial = 0; trial < 1500; ++trial) {
    std::string text = whole;
    for (std::size_t i = 1 + below(3); i > 0; --i) {
      const std::size_t at = below(text.size());
      switch (below(3)) {
        case 0:
          text[at] = often[below(often.size())];
          break;
        case 1:
          text.erase(at, 1 + below(8));
          break;
        default:
          text.insert(at, text.substr(below(text.size()), below(40)));
      }
    }
    std::ofstream(file) << text;
    const auto arm = SerialArm::from_urdf(file, "tool", {}, {{"finger_left", 0.01}});
    (arm ? read : refused) += 1;
    if (!arm) {
      EXPECT_THAT(arm.status().message(), testing::StartsWith(file.string() + ": "));
      continue;
    }
    LinkPoses X_WL;
    arm->link_poses({}, X_WL);
    for (std::size_t l = 0; l < arm->links().size(); ++l) {
      const Link& link = arm->links()[l];
      EXPECT_TRUE(X_WL[l].translation_m.allFinite() && link.centre_of_mass_m.allFinite());
      EXPECT_TRUE(std::isfinite(link.mass_kg) && link.mass_kg >= 0.0);
      for (const LinkMesh& mesh : link.meshes) {
        EXPECT_TRUE(mesh.X_link_mesh.rotation.allFinite() && mesh.X_link_mesh.translation_m.allFinite());
        EXPECT_TRUE(mesh.body.all_finite());
      }
    }
  }
  EXPECT_GT(read, 100U);
  EXPECT_GT(refused, 100U);
}

// Arms that others drew: of Debian's package dart-doc (scripts/setup installs it).
TEST(ForeignUrdf, AnotherLaboratorysRobotsLoadWholeWithTheirHandsHeld) {
  const std::filesystem::path dart = "/usr/share/doc/dart/data/urdf";
  if (!std::filesystem::is_directory(dart)) GTEST_SKIP() << "dart-doc is not installed";
  struct Laboratory {
    const char *file, *tip;
    std::size_t joints;
  };
  for (const Laboratory& one :
       {Laboratory{"drchubo/drchubo.urdf", "Body_LWP", 6}, Laboratory{"wam/wam.urdf", "/wam7", 7}}) {
    const auto arm = SerialArm::from_urdf(dart / one.file, one.tip, {});
    ASSERT_TRUE(arm) << arm.status().message();
    EXPECT_GE(arm->joint_count(), one.joints);
    const auto model = urdf::parseURDF(test::text_of(dart / one.file));
    double expected_kg = 0.0, total_kg = 0.0;
    std::size_t frames = 0;
    for (const auto& [name, link] : model->links_) {
      if (link->inertial) expected_kg += link->inertial->mass;
    }
    for (const Link& link : arm->links()) total_kg += link.mass_kg, frames += link.frames.size();
    EXPECT_EQ(frames, model->links_.size()) << "every link of the file is part of a moving one";
    EXPECT_NEAR(total_kg, expected_kg, 1e-9 * expected_kg);
  }
}

}  // namespace
}  // namespace phantom::robot
