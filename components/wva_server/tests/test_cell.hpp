#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "components/wva_server/wva_server.hpp"
#include "tests/support/ascii_stl.hpp"
#include "tests/support/files.hpp"

namespace phantom::wva_server {

/// A folder with a small cell: a ball and two posts that share a mesh, meshes in millimetres.
class TestCell : public ::testing::Test {
 protected:
  void SetUp() override {
    write("ball.stl", ascii_stl(geometry::make_sphere(60, 3)));
    write("post.stl", ascii_stl(geometry::make_box({40, 40, 300})));
    write("arm.urdf",
          R"(<robot name="arm"><link name="base"/><link name="tool"/><joint name="turn" type="revolute">
<parent link="base"/><child link="tool"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>)");
    write("cell.yaml", kCell);
  }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  /// The cell file with one text replaced.
  std::filesystem::path cell_with(const std::string& from, const std::string& to) const {
    std::string text = kCell;
    const auto place = text.find(from);
    EXPECT_NE(place, std::string::npos) << from;
    text.replace(place, from.size(), to);
    return write("cell.yaml", text);
  }
  std::filesystem::path cell() const { return folder_ / "cell.yaml"; }

  /// A cell file's cell, activated.
  static LiveCell activated(const std::filesystem::path& file, std::uint64_t version = 7,
                            const AddLimits& limits = {}) {
    const auto loaded = runtime::load_cell(file);
    LiveCell live(loaded, limits);
    double time_s = 0.0;  // a clock that ticks with every look
    const auto change =
        live.activate(runtime::load_bodies(loaded, {}), version,
                      {.stopwatch = [&time_s] { return time_s += 1.0; }}, [](const auto&...) {});
    EXPECT_TRUE(change) << change.status().message();
    return live;
  }
  static WorkspaceCommand make_command(WorkspaceOperation operation, const std::string& object,
                                       std::uint16_t id = 0, const geometry::Pose& X_WO = {},
                                       const std::string& description = "",
                                       std::optional<std::uint16_t> guard_vox = {}) {
    WorkspaceCommand command;
    command.operation = operation;
    command.object = object;
    command.id = id;
    command.X_WO = X_WO;
    command.guard_vox = guard_vox;
    command.description = description;
    return command;
  }
  static std::int8_t order_at(const workspace::Workspace& workspace, double x, double y, double z) {
    return workspace.order(workspace.grid().index_of({x, y, z}));
  }

  std::filesystem::path folder_ = test::new_folder();

 private:
  static constexpr const char* kCell = R"(name: desk
workspace: {min_m: [-0.4, -0.4, 0.0], max_m: [0.4, 0.4, 0.5], voxel_size_m: 0.01}
profile: {thickness_vox: [2, 2], mu_Pa_s_per_m: [32, 20], mu_skin_Pa_s_per_m: 100}
objects:
  - {name: ball, mesh: ball.stl, mesh_scale: 0.001, pose: {xyz_m: [0.0, 0.0, 0.3]}, colour: [1, 0, 0],
     real_deviation: {xyz_m: [0.05, 0.0, 0.0]}}
  - {name: left post, mesh: post.stl, mesh_scale: 0.001, pose: {xyz_m: [-0.2, 0.1, 0.15], rpy_deg: [0, 0, 30]}}
  - {name: right post, mesh: post.stl, mesh_scale: 0.001, pose: {xyz_m: [0.2, 0.1, 0.15]},
     profile: {thickness_vox: [3], mu_Pa_s_per_m: [25], mu_skin_Pa_s_per_m: 90, guard_vox: 1}}
arms:
  - {name: arm, urdf: arm.urdf, tip_link: tool, home: [0.0]}
)";
};

}  // namespace phantom::wva_server
