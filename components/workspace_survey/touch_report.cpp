#include "components/workspace_survey/touch_report.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/core/units.hpp"
#include "common/runtime/configuration/pose_text.hpp"
#include "components/workspace_survey/report.hpp"

namespace phantom::workspace_survey {
namespace {

constexpr int kMaxGuard_vox = 100;  // that a command may ask for

std::string vector_text(const Eigen::Vector3d& v, int digits) {
  const double unit = std::pow(10.0, -digits);
  const auto rounded = [&](double x) { return std::round(x / unit) * unit + 0.0; };  // no "-0.0"
  return fmt::format("({:.{}f} {:.{}f} {:.{}f})", rounded(v.x()), digits, rounded(v.y()), digits,
                     rounded(v.z()), digits);
}

Eigen::Vector3d shift_m(const survey::TouchCorrection& c) {
  return c.fit.centre_W_m - c.model_WO * (c.fit.X_WO.inverse() * c.fit.centre_W_m);
}

std::string shift_and_turn(const survey::TouchCorrection& c) {
  return fmt::format("shift {} mm at its middle, turn {:.2f} deg", vector_text(1e3 * shift_m(c), 1),
                     c.turned_rad / core::kRadPerDegree);
}

std::string listed(const std::vector<survey::TouchDirection>& directions, const char* name,
                   const char* none) {
  if (directions.empty()) return fmt::format("{:<13}{}\n", name, none);
  std::string text;
  for (const auto& direction : directions) {
    text += fmt::format("{:<13}{} (one sigma)\n", text.empty() ? name : "", direction.words);
  }
  return text;
}

nlohmann::json json_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::json json_of(const std::vector<survey::TouchDirection>& directions) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& d : directions) {
    list.push_back({{"words", d.words},
                    {"turn_rad", json_of(Eigen::Vector3d(d.motion.head<3>()))},
                    {"shift_m", json_of(Eigen::Vector3d(d.motion.tail<3>()))},
                    {"worst_point_sigma_m", d.sigma_m}});
  }
  return list;
}

}  // namespace

int guard_before(const TouchFindings& findings) {
  return std::clamp(survey::guard_voxels(findings.correction.worst_before_m, findings.voxel_size_m),
                    findings.least_guard_vox, kMaxGuard_vox);
}

int guard_after(const TouchFindings& findings) {
  return std::clamp(survey::guard_voxels(findings.correction.worst_after_m, findings.voxel_size_m),
                    findings.least_guard_vox, kMaxGuard_vox);
}

std::string touch_line(const TouchFindings& findings) {
  const auto& c = findings.correction;
  const survey::Touch& touch = findings.touches.back();
  const double gap_m = c.before_m.back();
  return fmt::format(
      "touch {:<2}     at {} m, pushed along {}: {:.1f} mm {} the model; so far {}, {} of 6 determined\n",
      findings.touches.size(), vector_text(touch.p_W_m, 4),
      touch.normal_W ? vector_text(*touch.normal_W, 2) : "an unknown direction", 1e3 * std::abs(gap_m),
      gap_m < 0 ? "inside" : "outside of", shift_and_turn(c), c.determined.size());
}

std::string change_text(const TouchFindings& findings) {
  const auto& c = findings.correction;
  std::string text = fmt::format("object:      {}, {} touches, {} places inside the model without one\n",
                                 findings.object, findings.touches.size(), findings.free.size());
  text += fmt::format("before:      \"{}\"  (x y z in m, roll pitch yaw in deg)\n",
                      runtime::pose_text(c.model_WO));
  text += fmt::format("after:       \"{}\"\n", runtime::pose_text(c.fit.X_WO));
  text +=
      fmt::format("change:      {}; its worst point moves {:.1f} mm\n", shift_and_turn(c), 1e3 * c.moved_m);
  std::string gaps;
  for (std::size_t i = 0; i < c.before_m.size(); ++i) {
    const bool explained = std::find(c.unexplained.begin(), c.unexplained.end(), i) == c.unexplained.end();
    gaps += fmt::format("{}{} {:+.1f}/{}", gaps.empty() ? "" : ", ", i + 1, 1e3 * c.before_m[i],
                        explained ? fmt::format("{:+.1f}", 1e3 * c.after_m[i]) : "not of this object");
  }
  if (!gaps.empty()) text += "touches:     " + gaps + " (mm from the model, before/after)\n";
  text += listed(c.determined, "determined:", "nothing");
  text += listed(c.open, "open:", "nothing");
  text += c.fit.degrees > 0 ? fmt::format("fit:         probability {:.2g} (chi2 {:.1f} of {} degrees)\n",
                                          c.fit.probability(), c.fit.chi2, c.fit.degrees)
                            : "fit:         no touch to spare that would check the others\n";
  text += fmt::format(
      "uncertainty: no point off by more than {:.1f} mm ({:.1f} %); of the model as it was {:.1f} mm\n",
      1e3 * c.worst_after_m, 100 * findings.confidence, 1e3 * c.worst_before_m);
  if (c.contradicts)
    text +=
        fmt::format("guard:       j = {} (skin voxels of {}); until it is applied j = {}\n",
                    guard_after(findings), guard_voxel_text(findings.voxel_size_m), guard_before(findings));
  if (!c.refusal.empty()) text += "refused:     " + c.refusal + "\n";
  if (!c.contradicts)
    text += "the model agrees with what was touched, within its errors: nothing to change\n";
  return text;
}

std::string json_text(const TouchFindings& findings, bool applied) {
  const auto& c = findings.correction;
  nlohmann::json touches = nlohmann::json::array();
  for (std::size_t i = 0; i < findings.touches.size(); ++i) {
    const survey::Touch& t = findings.touches[i];
    const bool explained = std::find(c.unexplained.begin(), c.unexplained.end(), i) == c.unexplained.end();
    touches.push_back({{"p_W_m", json_of(t.p_W_m)},
                       {"radius_m", t.radius_m},
                       {"sigma_m", t.sigma_m},
                       {"normal_W", t.normal_W ? json_of(*t.normal_W) : nlohmann::json()},
                       {"gap_before_m", c.before_m[i]},
                       {"gap_after_m", c.after_m[i]},
                       {"explained", explained}});
  }
  nlohmann::json covariance = nlohmann::json::array();
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) covariance[row][column] = c.fit.covariance(row, column);
  }
  const nlohmann::json json = {
      {"object", findings.object},
      {"touches", touches},
      {"places_without_touch", findings.free.size()},
      {"contradicts", c.contradicts},
      {"before", runtime::pose_text(c.model_WO)},
      {"after", runtime::pose_text(c.fit.X_WO)},
      {"shift_m", json_of(shift_m(c))},
      {"turn_deg", c.turned_rad / core::kRadPerDegree},
      {"worst_point_moves_m", c.moved_m},
      {"centre_W_m", json_of(c.fit.centre_W_m)},
      {"covariance", covariance},  // of (turn in rad, shift in m) about the centre, axes of W
      {"determined", json_of(c.determined)},
      {"open", json_of(c.open)},
      {"worst_point_off_m", c.worst_after_m},
      {"confidence", findings.confidence},
      {"guard_vox", guard_after(findings)},
      {"guard_until_applied_vox", c.contradicts ? nlohmann::json(guard_before(findings)) : nlohmann::json()},
      {"refusal", c.refusal},
      {"applied", applied}};
  return json.dump(2) + "\n";
}

}  // namespace phantom::workspace_survey
