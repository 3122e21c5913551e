#pragma once

#include <gtest/gtest.h>

#include <string>

#include "common/core/units.hpp"
#include "common/geometry/mesh/mesh_io.hpp"
#include "common/survey/error_aid.hpp"
#include "common/survey/fit.hpp"
#include "common/survey/identify.hpp"
#include "common/survey/visible.hpp"

namespace phantom::survey {

/// A part of the shipped library.
inline PartModel shipped_part(const std::string& name) {
  geometry::MeshImportOptions options;
  options.scale = 0.001;
  options.y_up = false;
  const std::string file = name == "vice" ? "cells/hot_cell/meshes/vice.stl" : "parts/" + name + ".obj";
  const auto mesh = geometry::load_mesh(std::string(PHANTOM_SOURCE_DIR) + "/deploy/" + file, options);
  if (!mesh) throw std::runtime_error(mesh.status().message());
  return make_part(name, *mesh);
}

inline const std::vector<std::string>& shipped_names() {
  static const std::vector<std::string> names = {
      "v_groove_block", "cube", "bar", "brick", "wedge", "angle_bracket", "stepped_block", "hexagon", "vice"};
  return names;
}

/// All of them, loaded once.
inline const std::vector<PartModel>& shipped_library() {
  static const std::vector<PartModel> library = [] {
    std::vector<PartModel> parts;
    for (const std::string& name : shipped_names()) parts.push_back(shipped_part(name));
    return parts;
  }();
  return library;
}

inline const PartModel& part_named(const std::string& name) {
  for (const PartModel& part : shipped_library()) {
    if (part.name == name) return part;
  }
  throw std::runtime_error(name);
}

/// A head 3.5 m from the origin of W, above and aside, that looks down on it.
inline RangeHead test_head() {
  RangeHead head;
  head.X_WH = {geometry::rotation_from_rpy(0, 0, 50 * core::kRadPerDegree), {-1.6, -1.9, 2.46}};
  head.beam_offset_m = 0.06;
  return head;
}

/// A pose near W's origin, turned any way.
inline geometry::Pose random_pose(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> place(-0.1, 0.1);
  const Eigen::Vector4d q =
      Eigen::Vector4d(normal(random), normal(random), normal(random), normal(random)).normalized();
  return {geometry::rotation_from_quaternion(q), {place(random), place(random), place(random)}};
}

/// What a person would measure of a part at a pose.
inline Measurement measure(const PartModel& part, const geometry::Pose& X_WO, const RangeHead& head,
                           const HeadErrors& errors, std::mt19937_64& random,
                           const VisibleOptions& options = {}) {
  const auto targetings = simulate_targetings(
      part, X_WO, visible_faces(part, X_WO, head.X_WH.translation_m, options), head, errors, random);
  if (!targetings) throw std::runtime_error(targetings.status().message());
  const auto measurement = register_nodes(head, errors, *targetings);
  if (!measurement) throw std::runtime_error(measurement.status().message());
  return *measurement;
}

}  // namespace phantom::survey
