#include "components/workspace_survey/report.hpp"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/core/units.hpp"
#include "common/runtime/configuration/pose_text.hpp"

namespace phantom::workspace_survey {
namespace {

using survey::FaceMetrics;
using survey::MeasuredFace;
using survey::Placement;

constexpr std::size_t kMaxPoses = 12;

std::string poses_line(const SurveyReport& report, const survey::Candidate& candidate,
                       const Placement& placement) {
  std::string pose =
      placement.fit ? "pose \"" + runtime::pose_text(placement.fit->X_WO) + "\"" : "not determined yet";
  const auto same = static_cast<std::size_t>(
      std::count_if(candidate.placements.begin(), candidate.placements.end(),
                    [&](const Placement& p) { return p.same_space_as == placement.same_space_as; }));
  if (placement.fit && same > 1) pose += fmt::format("  (with {} more that occupy the same space)", same - 1);
  std::string nodes;
  for (std::size_t i = 0; i < placement.map.size(); ++i) {
    if (placement.map[i] == survey::kNotMapped) continue;
    nodes += (nodes.empty() ? "" : " ") + report.measurement.nodes[i].name + "=" +
             std::to_string(placement.map[i]);
  }
  return fmt::format("chi2 {:.1f}, {}, nodes {}\n", placement.chi2, pose, nodes);
}

/// Returns the residual along the beam and across it, in m.
std::pair<double, double> along_and_across_m(const survey::MeasuredNode& node,
                                             const Eigen::Vector3d& residual) {
  const double along = residual.dot(node.beam_W);
  return {along, (residual - along * node.beam_W).norm()};
}

nlohmann::json pose_json(const geometry::Pose& X) {
  const Eigen::Vector4d q = geometry::quaternion_xyzw(X.rotation);
  return {{"xyz_m", {X.translation_m.x(), X.translation_m.y(), X.translation_m.z()}},
          {"quaternion_xyzw", {q[0], q[1], q[2], q[3]}},
          {"text", runtime::pose_text(X)}};
}

nlohmann::json json_of(const workspace::VoxelSize& size) {
  if (size.is_cube()) return size.reference_m();
  return {size[0], size[1], size[2]};
}

}  // namespace

std::string guard_voxel_text(const workspace::VoxelSize& size) {
  const std::string least = fmt::format("{:.3g} mm", 1e3 * size.reference_m());
  if (size.is_cube()) return least;
  return least + fmt::format(", the shortest side of {:.3g} x {:.3g} x {:.3g} mm", 1e3 * size[0],
                             1e3 * size[1], 1e3 * size[2]);
}

int guard_of(const SurveyReport& report) {
  return survey::guard_voxels(report.result.object->worst_displacement_m, report.voxel_size_m);
}

std::string measured_text(const SurveyReport& report) {
  const auto& m = report.measurement;
  std::string text = fmt::format("measured: {} nodes on {} faces\n", m.nodes.size(), m.faces.size());
  for (std::size_t f = 0; f < m.faces.size(); ++f) {
    const MeasuredFace& face = m.faces[f];
    const FaceMetrics metrics = survey::face_metrics(survey::corners_of(m, face), face.closed, m.eye_W_m);
    text +=
        fmt::format("  face {} ({}, {} corners{})\n", face.name, face.closed ? "whole" : "a part",
                    face.nodes.size(), face.closed ? fmt::format(", {:.1f} cm2", 1e4 * metrics.area_m2) : "");
    const bool checked =
        f < report.result.checks.size() && report.result.checks[f].nodes.size() == face.nodes.size();
    for (std::size_t i = 0; i < face.nodes.size(); ++i) {
      text += fmt::format("    {:<8}", m.nodes[face.nodes[i]].name);
      if (metrics.angle_rad[i] != 0)
        text += fmt::format(" angle {:6.1f} deg", metrics.angle_rad[i] / core::kRadPerDegree);
      if (i < metrics.edge_m.size()) {
        text += fmt::format("  edge to {:<6} {:7.1f} mm",
                            m.nodes[face.nodes[(i + 1) % face.nodes.size()]].name, 1e3 * metrics.edge_m[i]);
      }
      if (checked && report.result.checks[f].redundant) {
        const survey::NodeCheck& check = report.result.checks[f].nodes[i];
        text += fmt::format("  normal {:4.1f} deg off, range {:+5.1f} mm off the plane{}",
                            check.normal_departs_rad / core::kRadPerDegree, 1e3 * check.off_plane_m,
                            check.suspect ? "  <- suspect" : "");
      }
      text += '\n';
    }
  }
  return text;
}

std::string candidates_text(const SurveyReport& report) {
  const auto& found = report.result.identification.candidates;
  std::string text = fmt::format("candidates: {} of {} parts\n", found.size(), report.library.parts.size());
  for (const survey::Candidate& candidate : found) {
    const Placement& best = candidate.placements.front();
    text += fmt::format("  {:<20} {}{} placement{}, worst length {:.1f} sigma off, {}",
                        report.library.parts[candidate.part].name, candidate.all_found ? "" : "at least ",
                        candidate.placements.size(), candidate.placements.size() == 1 ? "" : "s",
                        best.worst_sigmas, poses_line(report, candidate, best));
  }
  return text;
}

std::string alternatives_text(const SurveyReport& report) {
  const auto all = survey::alternatives_of(report.result.identification);
  if (report.result.object || all.size() < 2) return "";
  std::string text = "alternatives, which a person may pick:\n";
  for (std::size_t i = 0; i < std::min(kMaxPoses, all.size()); ++i) {
    const survey::Candidate& candidate = report.result.identification.candidates[all[i].candidate];
    text += fmt::format("  {:>2}  {:<18}{}", i + 1, report.library.parts[candidate.part].name,
                        poses_line(report, candidate, candidate.placements[all[i].placement]));
  }
  if (all.size() > kMaxPoses) text += fmt::format("  and {} more\n", all.size() - kMaxPoses);
  return text;
}

std::string fit_text(const SurveyReport& report) {
  std::string text;
  if (report.result.object) {
    const survey::FittedObject& object = *report.result.object;
    text += fmt::format("part:        {}\npose:        \"{}\"  (x y z in m, roll pitch yaw in deg)\n",
                        report.library.parts[object.part].name, runtime::pose_text(object.fit.X_WO));
    if (object.picked_among > 0)
      text += fmt::format("             picked by a person among {} that agree\n", object.picked_among);
    if (object.symmetric > 1)
      text += fmt::format("             {} more poses occupy the same space\n", object.symmetric - 1);
    if (object.four_steps_WO) {
      text += fmt::format("             the four steps alone: \"{}\", {:.1f} mm from it at the worst point\n",
                          runtime::pose_text(*object.four_steps_WO),
                          1e3 * survey::displacement_between_m(report.library.models[object.part],
                                                               *object.four_steps_WO, object.fit.X_WO));
    }
    text += fmt::format("fit:         probability {:.2g} (chi2 {:.1f} of {} degrees)\n",
                        object.fit.probability(), object.fit.chi2, object.fit.degrees);
    text += fmt::format(
        "uncertainty: {:.1f} mm, {:.2f} deg (one sigma, worst direction); "
        "no point off by more than {:.1f} mm ({:.1f} %)\n",
        1e3 * object.fit.position_sigma_m(), object.fit.orientation_sigma_rad() / core::kRadPerDegree,
        1e3 * object.worst_displacement_m, 100 * report.config.options.confidence);
    text += fmt::format("             the head's mounting alone: {:.1f} mm of it\n",
                        1e3 * object.mounting_displacement_m);
    text += fmt::format("guard:       j = {} (skin voxels of {})\nresiduals:   ", guard_of(report),
                        guard_voxel_text(report.voxel_size_m));
    for (std::size_t i = 0; i < object.fit.nodes.size(); ++i) {
      const survey::MeasuredNode& node = report.measurement.nodes[object.fit.nodes[i]];
      const auto [along, across] = along_and_across_m(node, object.fit.residual_W_m[i]);
      text += fmt::format("{}{} {:+.1f}/{:.1f}", i == 0 ? "" : ", ", node.name, 1e3 * along, 1e3 * across);
    }
    text += "  (mm along/across the beam)\n";
  } else {
    text += "refused:     " + report.result.refusal + "\n";
  }
  for (const std::string& said : report.result.advice) text += "advice:      " + said + "\n";
  return text;
}

std::string json_text(const SurveyReport& report) {
  nlohmann::json all, candidates = nlohmann::json::array(), nodes = nlohmann::json::array();
  for (const survey::Candidate& candidate : report.result.identification.candidates) {
    const Placement& best = candidate.placements.front();
    candidates.push_back({{"part", report.library.parts[candidate.part].name},
                          {"placements", candidate.placements.size()},
                          {"chi2", best.chi2},
                          {"worst_sigmas", best.worst_sigmas}});
  }
  for (const survey::MeasuredNode& node : report.measurement.nodes)
    nodes.push_back({{"name", node.name},
                     {"p_W_m", {node.p_W_m.x(), node.p_W_m.y(), node.p_W_m.z()}},
                     {"times", node.times}});
  all = {{"nodes", nodes},
         {"candidates", candidates},
         {"accepted", report.result.object.has_value()},
         {"advice", report.result.advice}};
  if (!report.result.object) {
    all["refusal"] = report.result.refusal;
    return all.dump(2) + "\n";
  }
  const survey::FittedObject& object = *report.result.object;
  nlohmann::json residuals = nlohmann::json::object(), covariance = nlohmann::json::array();
  for (std::size_t i = 0; i < object.fit.nodes.size(); ++i) {
    const Eigen::Vector3d& r = object.fit.residual_W_m[i];
    residuals[report.measurement.nodes[object.fit.nodes[i]].name] = {r.x(), r.y(), r.z()};
  }
  for (int row = 0; row < 6; ++row) {
    nlohmann::json line = nlohmann::json::array();
    for (int column = 0; column < 6; ++column) line.push_back(object.fit.covariance(row, column));
    covariance.push_back(line);
  }
  all["object"] = {
      {"part", report.library.parts[object.part].name},
      {"X_WO", pose_json(object.fit.X_WO)},
      {"centre_W_m", {object.fit.centre_W_m.x(), object.fit.centre_W_m.y(), object.fit.centre_W_m.z()}},
      {"covariance_rad_m", covariance},
      {"position_sigma_m", object.fit.position_sigma_m()},
      {"orientation_sigma_rad", object.fit.orientation_sigma_rad()},
      {"worst_displacement_m", object.worst_displacement_m},
      {"mounting_displacement_m", object.mounting_displacement_m},
      {"confidence", report.config.options.confidence},
      {"probability", object.fit.probability()},
      {"symmetric_poses", object.symmetric},
      {"picked_among", object.picked_among},
      {"guard_vox", guard_of(report)},
      {"voxel_size_m", json_of(report.voxel_size_m)},
      {"residuals_W_m", residuals}};
  if (object.four_steps_WO) all["object"]["four_steps_X_WO"] = pose_json(*object.four_steps_WO);
  return all.dump(2) + "\n";
}

}  // namespace phantom::workspace_survey
