// What the shipped hot cell promises: it loads, its meshes are closed, the arm is clear at home, and each of
// the reaches goes from free space into the object that it names.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>

#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "common/simulation/mesh_world.hpp"

namespace phantom {
namespace {

const std::filesystem::path kFolder = std::filesystem::path(PHANTOM_SOURCE_DIR) / "deploy/cells/hot_cell";

struct Reach {
  std::string name, object;
  std::vector<double> from, target;
};

std::vector<Reach> load_reaches() {
  const runtime::Fields file(kFolder / "reaches.yaml",
                             {"reaches:\n  - name: x\n    object: x\n    from: []\n    target: []"});
  std::vector<Reach> reaches;
  for (const runtime::Fields& item : file.sections("reaches")) {
    Reach& reach = reaches.emplace_back(Reach{item.text("name"), item.text("object"), {}, {}});
    item.numbers("from", reach.from);
    item.numbers("target", reach.target);
  }
  file.finish();
  return reaches;
}

/// Directed edges that do not have exactly one opposite: none in a closed, consistently oriented surface.
std::size_t open_edges(const geometry::TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  }
  std::size_t open = 0;
  for (const auto& [edge, count] : edges) {
    const auto opposite = edges.find({edge.second, edge.first});
    open += count != 1 || opposite == edges.end() || opposite->second != 1;
  }
  return open;
}

/// The cell with its arm and a coarse skin, loaded once for all tests of the process.
class HotCell {
 public:
  static const HotCell& get() {
    static const HotCell cell;
    return cell;
  }

  /// Every sensor of the arm in W at a pose, with its link.
  template <class Visit>
  void for_each_sensor(const std::vector<double>& joints, Visit visit) const {
    core::JointArray q{};
    std::copy(joints.begin(), joints.end(), q.begin());
    robot::LinkPoses X_WL;
    arm_.link_poses(q, X_WL);
    for (std::size_t s = 0; s < skin_.size(); ++s) {
      const std::size_t link = skin_.link_of(s);
      visit(X_WL[link] * skin_.position(s), arm_.links()[link].name);
    }
  }
  const robot::SerialArm& arm() const { return arm_; }
  std::size_t full_skin_size() const { return full_skin_size_; }

  runtime::CellConfig cell = runtime::load_cell(kFolder / "cell.yaml");
  std::vector<runtime::CellBody> bodies = runtime::load_bodies(cell);

 private:
  HotCell() {
    const auto& config = cell.arm("suspended_arm");
    auto arm = robot::SerialArm::from_urdf(config.urdf, config.tip_link, config.X_WB);
    if (!arm) throw std::runtime_error(arm.status().message());
    arm_ = std::move(*arm);
    full_skin_size_ = lay_out(0.99).size();
    skin_ = lay_out(2.0);
  }
  robot::SkinLayout lay_out(double pitch_vox) const {
    std::vector<robot::LinkSkin> skin;
    for (const auto& link : cell.arm().skin) {
      skin.push_back({link.link, {}});
      for (const auto& s : link.segments) {
        skin.back().segments.push_back(
            {s.from_m, s.to_m, s.from_radius_m, s.to_radius_m, s.sides, s.rings, s.spin_rad, s.gain});
      }
    }
    auto layout = robot::lay_out_skin(arm_, skin, {cell.voxel_size_m, pitch_vox});
    if (!layout) throw std::runtime_error(layout.status().message());
    return std::move(*layout);
  }
  robot::SerialArm arm_;
  robot::SkinLayout skin_;
  std::size_t full_skin_size_ = 0;
};

struct Nearest {
  double distance_m = 0.0;
  std::string object, link;
};

/// Distance to all objects, as far as 0.3 m.
class Surroundings {
 public:
  static const Surroundings& get() {
    static const Surroundings all;
    return all;
  }

  /// Of all skin sensors, to any object or, if given, to any other than `except`.
  Nearest nearest(const std::vector<double>& joints, const std::string& except = "") const {
    Nearest found{kFar_m, "", ""};
    HotCell::get().for_each_sensor(joints, [&](const Eigen::Vector3d& p_W_m, const std::string& link) {
      const simulation::ContactQuery there = world_.query(p_W_m);
      if (there.object == 0 || there.distance_m >= found.distance_m) return;
      const std::string& name = HotCell::get().cell.objects[there.object - 1U].name;
      if (name != except) found = {there.distance_m, name, link};
    });
    return found;
  }

 private:
  static constexpr double kFar_m = 0.3;
  Surroundings() : world_(bodies(), kFar_m) {}
  static std::vector<geometry::PlacedMesh> bodies() {
    std::vector<geometry::PlacedMesh> bodies;
    for (const runtime::CellBody& object : HotCell::get().bodies)
      bodies.push_back({object.body.mesh_W, object.body.id});
    return bodies;
  }
  simulation::MeshWorld world_;
};

std::vector<double> between(const Reach& reach, double share) {
  std::vector<double> joints(reach.from.size());
  for (std::size_t i = 0; i < joints.size(); ++i)
    joints[i] = reach.from[i] + share * (reach.target[i] - reach.from[i]);
  return joints;
}

TEST(HotCell, HoldsAtLeastTwelveObjectsAndOneArm) {
  const auto& cell = HotCell::get().cell;
  EXPECT_GE(cell.objects.size(), 12U);
  ASSERT_EQ(cell.arms.size(), 1U);
  EXPECT_GE((cell.max_m - cell.min_m).minCoeff(), 1.5);
}

TEST(HotCell, EveryMeshIsClosedAndOfWorkableSize) {
  std::size_t total = 0;
  for (const runtime::CellBody& object : HotCell::get().bodies) {
    const auto& mesh = object.mesh_O;
    const std::string& name = object.body.name;
    EXPECT_EQ(open_edges(mesh), 0U) << name;
    EXPECT_GE(mesh.triangles.size(), 500U) << name;
    EXPECT_LE(mesh.triangles.size(), 20'000U) << name;
    EXPECT_GT(geometry::enclosed_volume_m3(mesh), 1e-4) << name << " (faces outwards)";
    EXPECT_TRUE(object.notes.empty()) << name << ": " << object.notes.front();
    total += mesh.triangles.size();
  }
  EXPECT_LT(total, 120'000U);
}

TEST(HotCell, EveryLinkMeshIsClosed) {
  for (const auto& link : HotCell::get().arm().links()) {
    for (const auto& mesh : link.meshes)
      EXPECT_EQ(open_edges(robot::load_mesh(mesh).value()), 0U) << mesh.file;
  }
}

TEST(HotCell, EveryObjectStandsInTheWorkspace) {
  const auto& cell = HotCell::get().cell;
  for (const runtime::CellBody& object : HotCell::get().bodies) {
    const auto box = object.body.mesh_W.bounding_box();
    EXPECT_TRUE((box.min_m.cast<double>().array() >= cell.min_m.array() - 1e-6).all()) << object.body.name;
    EXPECT_TRUE((box.max_m.cast<double>().array() <= cell.max_m.array() + 1e-6).all()) << object.body.name;
  }
}

TEST(HotCell, SomeObjectsReallyStandABitElsewhere) {
  int deviating = 0;
  for (const auto& object : HotCell::get().cell.objects) {
    const double offset_m = object.X_deviation.translation_m.norm();
    deviating += offset_m > 0.0;
    EXPECT_LT(offset_m, 0.010) << object.name;
  }
  EXPECT_GE(deviating, 2);
}

TEST(HotCell, TheArmHasSevenJointsAndASkinOnEveryMovingLink) {
  const HotCell& cell = HotCell::get();
  EXPECT_EQ(cell.arm().joint_count(), 7U);
  EXPECT_EQ(cell.arm().joints().front().type, robot::JointType::kPrismatic);
  std::set<std::string> skinned;
  for (const auto& link : cell.cell.arm().skin) skinned.insert(link.link);
  for (std::size_t i = 1; i < cell.arm().links().size(); ++i) {
    EXPECT_TRUE(skinned.contains(cell.arm().links()[i].name)) << cell.arm().links()[i].name;
    EXPECT_GT(cell.arm().links()[i].mass_kg, 0.5);
  }
  EXPECT_GT(cell.full_skin_size(), 10'000U);
  EXPECT_LT(cell.full_skin_size(), 32'000U);
}

TEST(HotCell, TheJointsCarryTheArmInEveryPose) {
  const HotCell& cell = HotCell::get();
  robot::LinkPoses X_WL;
  for (double shoulder : {-1.6, -0.8, 0.0, 0.8, 1.6}) {
    for (double elbow : {-1.6, 0.0, 1.6}) {
      cell.arm().link_poses({0, 0.7, shoulder, elbow, 0.5, 0.9, 0}, X_WL);
      const auto torque = cell.arm().gravity_torque(X_WL);
      for (std::size_t j = 0; j < 7; ++j)
        EXPECT_LT(std::abs(torque[j]), 0.7 * cell.arm().joints()[j].max_effort) << j;
    }
  }
}

TEST(HotCell, HomeIsClearOfEverything) {
  const auto nearest = Surroundings::get().nearest(HotCell::get().cell.arm().home);
  EXPECT_GE(nearest.distance_m, 0.25) << nearest.link << " to " << nearest.object;
}

// One test per promise, not per reach: loading the cell costs more than checking all of them.

TEST(Reaches, KeepWithinTheJointLimits) {
  const auto& joints = HotCell::get().arm().joints();
  for (const Reach& reach : load_reaches()) {
    for (const auto& pose : {reach.from, reach.target}) {
      ASSERT_EQ(pose.size(), joints.size()) << reach.name;
      for (std::size_t j = 0; j < pose.size(); ++j) {
        EXPECT_GE(pose[j], joints[j].lower) << reach.name << ": " << joints[j].name;
        EXPECT_LE(pose[j], joints[j].upper) << reach.name << ": " << joints[j].name;
      }
    }
  }
}

TEST(Reaches, StartClearAndEndInTheNamedObject) {
  for (const Reach& reach : load_reaches()) {
    SCOPED_TRACE(reach.name);
    const auto start = Surroundings::get().nearest(reach.from);
    EXPECT_GT(start.distance_m, 0.15) << start.link << " to " << start.object;
    const auto end = Surroundings::get().nearest(reach.target);
    EXPECT_EQ(end.object, reach.object);
    EXPECT_LT(end.distance_m, -0.002) << end.link;
    EXPECT_GT(end.distance_m, -0.040) << "deeper than an operator would push";
  }
}

TEST(Reaches, TouchNothingElseAndTheirObjectOnlyLate) {
  constexpr int kSteps = 100, kFreeSteps = 75;
  for (const Reach& reach : load_reaches()) {
    for (int i = 0; i <= kSteps; ++i) {
      SCOPED_TRACE(reach.name + " at " + std::to_string(i) + " %");
      const auto joints = between(reach, static_cast<double>(i) / kSteps);
      const auto other = Surroundings::get().nearest(joints, reach.object);
      EXPECT_GT(other.distance_m, 0.010) << other.link << " to " << other.object;
      if (i > kFreeSteps) continue;
      const auto any = Surroundings::get().nearest(joints);
      EXPECT_GT(any.distance_m, 0.020) << any.link << " to " << any.object;
    }
  }
}

TEST(Reaches, AreManyAndIntoDifferentObjects) {
  std::set<std::string> objects, names;
  for (const auto& reach : load_reaches()) {
    objects.insert(reach.object);
    EXPECT_TRUE(names.insert(reach.name).second) << reach.name;
  }
  EXPECT_GE(objects.size(), 6U);
}

}  // namespace
}  // namespace phantom
