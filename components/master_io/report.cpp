#include "components/master_io/report.hpp"

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/runtime/servo/loop_json.hpp"

namespace phantom::master_io {
namespace {

using Json = nlohmann::ordered_json;

Json round_trip_json(const core::DurationHistogram& trips) {
  const auto us = [](std::int64_t ns) { return static_cast<double>(ns) * 1e-3; };
  return {{"p50_us", us(trips.quantile_ns(0.5))},
          {"p99_us", us(trips.quantile_ns(0.99))},
          {"p999_us", us(trips.quantile_ns(0.999))},
          {"max_us", us(trips.max_ns())},
          {"n", trips.count()}};
}

Json reach_json(const ReachRecord& reach, const Config& config, const runtime::CellConfig& cell) {
  const auto or_null = [](bool known, double value) { return known ? Json(value) : Json(); };
  const bool touched = reach.contact_s >= 0.0;
  const bool known = reach.contact_object >= 1 && reach.contact_object <= cell.objects.size();
  return {{"n", reach.number},
          {"name", config.labels[reach.index].name},
          {"object", config.labels[reach.index].object},
          {"percept", reach.percept},
          {"start_s", reach.start_s},
          {"onset_clearance_m", or_null(reach.onset_clearance_m >= 0.0, reach.onset_clearance_m)},
          {"peak_percept_Nm", reach.peak_percept_Nm},
          {"peak_operator_Nm", reach.peak_operator_Nm},
          {"contact_s", or_null(touched, reach.contact_s)},
          {"contact_speed_m_s", or_null(touched, reach.contact_speed_m_s)},
          {"contact_object", touched && known ? Json(cell.objects[reach.contact_object - 1U].name) : Json()}};
}

Json cartesian_json(const CartesianFigures& figures) {
  return {{"greatest_force_N", figures.greatest_force_N},
          {"greatest_moment_N_m", figures.greatest_moment_N_m},
          {"steepest_force_N_per_s", figures.steepest_force_N_per_s},
          {"greatest_excess_W", figures.greatest_excess_W},
          {"energy_from_hand_J", figures.energy_from_hand_J},
          {"least_followed", figures.least_followed},
          {"clutched_out", figures.clutched_out}};
}

Json mapping_json(const MappingFigures& figures, const MappingConfig& config) {
  Json all = Json::array();
  for (std::size_t m = 0; m < config.joints.size(); ++m) {
    const double torque_Nm = figures.greatest_torque_Nm[m], lever_m = config.lever_m[m];
    all.push_back({{"master", config.joints[m].name},
                   {"leads", config.leads[m]},
                   {"greatest_torque_Nm", torque_Nm},
                   {"greatest_hand_force_N", lever_m > 0.0 ? Json(torque_Nm / lever_m) : Json()},
                   {"energy_from_hand_J", figures.energy_from_hand_J[m]}});
  }
  return all;
}

}  // namespace

void write_report(const std::filesystem::path& file, const SessionFigures& figures, const ReachLog& reaches,
                  const Config& config, const runtime::CellConfig& cell) {
  Json report;
  for (const auto& loop : figures.loops) report["loops"][loop.name] = runtime::loop_json(loop);
  report["round_trip"] = round_trip_json(figures.round_trips);
  if (figures.cartesian != nullptr) report["cartesian"] = cartesian_json(*figures.cartesian);
  if (figures.mapping != nullptr)
    report["joint_mapping"] = mapping_json(*figures.mapping, config.mapping.value());
  report["law"] = teleop::name_of(config.feedback.law);
  report["percept_gain"] = config.percept_gain;
  report["damping_limit"] = Json::array();
  for (std::size_t j = 0; j < config.percept.joint_count; ++j) {
    report["damping_limit"].push_back(config.percept.damping_limit_Nms_per_rad[j]);
  }
  report["reaches"] = Json::array();
  for (std::size_t i = 0; i < reaches.size(); ++i)
    report["reaches"].push_back(reach_json(reaches[i], config, cell));
  std::ofstream stream(file);
  if (!stream) throw std::runtime_error(file.string() + ": cannot be written");
  stream << report.dump(2) << '\n';
}

}  // namespace phantom::master_io
