#include "components/phantom_sensing/tools/probe.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iostream>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/core/text.hpp"
#include "common/percept/closeness.hpp"
#include "common/robot/kinematics/joint_values.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "components/phantom_sensing/model.hpp"

namespace phantom::phantom_sensing {
namespace {

using core::ConfigError;

/// Returns the name as written in the CSV.
const char* name_of(percept::MotionClass motion) {
  constexpr std::array kNames{"none", "safe", "neutral", "dangerous"};
  return kNames[static_cast<std::size_t>(motion)];
}

/// Returns the row's member for a column, or nullptr for a name that is not allowed.
double* place(ProbeRow& row, const std::string& column, std::size_t joint_count) {
  if (column == "t") return &row.t_s;
  std::size_t joint = 0;
  if (column.size() < 2 || (column[0] != 'q' && column[0] != 'v')) return nullptr;
  const auto [end, error] = std::from_chars(column.data() + 1, column.data() + column.size(), joint);
  if (error != std::errc() || end != column.data() + column.size() || joint < 1 || joint > joint_count)
    return nullptr;
  return column[0] == 'q' ? &row.position[joint - 1] : &row.velocity[joint - 1];
}

void check_header(const std::vector<std::string>& columns, const std::string& where,
                  std::size_t joint_count) {
  const std::string allowed = "; allowed: t, q1…q" + std::to_string(joint_count) + ", v1…v" +
                              std::to_string(joint_count) + ", each once";
  ProbeRow seen;
  for (const std::string& column : columns) {
    double* target = place(seen, column, joint_count);
    if (target == nullptr) throw ConfigError(where + "column '" + column + "' is unknown" + allowed);
    if (*target != 0.0) throw ConfigError(where + "column '" + column + "' stands twice" + allowed);
    *target = 1.0;
  }
  if (columns.size() != 1 + 2 * joint_count) {
    throw ConfigError(where + "has " + std::to_string(columns.size()) + " columns" + allowed);
  }
}

std::ofstream open_for_writing(const std::filesystem::path& path) {
  std::ofstream file(path);
  if (!file) throw ConfigError(path.string() + ": cannot be written");
  file.precision(17);
  return file;
}

struct ProbeColumns {
  bool directional, medium, soft;
};

void write_row(const ProbeRow& row, const StepOutputs& out, std::size_t n, const ProbeColumns& columns,
               std::ostream& csv) {
  csv << row.t_s;
  for (std::size_t i = 0; i < n; ++i) csv << ',' << out.percept.drag_torque[i];
  for (std::size_t i = 0; i < n; ++i)
    csv << ',' << (row.velocity[i] >= 0 ? out.drag.plus[i] : out.drag.minus[i]);
  if (columns.directional) {
    for (std::size_t i = 0; i < n; ++i) csv << ',' << out.drag.plus[i];
    for (std::size_t i = 0; i < n; ++i) csv << ',' << out.drag.minus[i];
  }
  for (std::size_t i = 0; columns.medium && i < n; ++i) csv << ',' << out.drag.drift[i];
  for (std::size_t i = 0; columns.soft && i < n; ++i) csv << ',' << out.reaction.torque[i];
  for (std::size_t i = 0; columns.soft && i < n; ++i) csv << ',' << out.reaction.stiffness[i];
  const SkinPercept& p = out.percept;
  csv << ',' << p.mu << ',' << p.link << ',' << p.sensor << ',' << p.object;
  for (int axis = 0; axis < 3; ++axis) csv << ',' << p.position_W_m[axis];
  for (int axis = 0; axis < 3; ++axis) csv << ',' << p.gradient.pgv_W_m[axis];
  csv << ',' << p.gradient.strength << ',' << p.velocity_W_m_s.norm() << ',' << name_of(p.motion) << ','
      << static_cast<int>(p.rule);
  const Threat lead = out.threats.empty() || !out.threats.front().raises ? Threat{} : out.threats.front();
  const percept::TimeToContact& contact = lead.contact;
  csv << ',' << contact.time_s << ',' << contact.error_s << ',' << contact.gap_m << ','
      << std::count_if(out.threats.begin(), out.threats.end(),
                       [](const Threat& threat) { return threat.raises; });
  csv << ',' << out.worst.mu << ',' << out.worst.link << ',' << out.worst.sensor << ',' << out.worst.object
      << '\n';
}

/// Returns which joints go faster or meet more than the arm's drives have, in words; "": none.
std::string beyond_drives(const std::vector<robot::Joint>& joints, const ProbePeaks& peaks) {
  std::string text;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const robot::Joint& joint = joints[i];
    const bool slides = robot::is_prismatic(joint);
    const auto note = [&](const char* column, double peak, double most, const char* unit) {
      if (peak > most)
        text += fmt::format("{}{}{} reaches {:.3g} {}, the drive of joint {} {:.3g}",
                            text.empty() ? "" : "; ", column, i + 1, peak, unit, joint.name, most);
    };
    note("v", peaks.speed[i], joint.max_speed, slides ? "m/s" : "rad/s");
    note("tau", peaks.torque[i], joint.max_effort, slides ? "N" : "N·m");
  }
  return text;
}

}  // namespace

void add_options(runtime::Command probe, ProbeRequest& request) {
  probe.option("--cell", request.cell, "cell file; its meshes make the workspace").required();
  probe.option("--arm", request.arm, "arm of the cell, if it has several");
  probe.option("--joints", request.joints, "poses: CSV with columns t, q1…qn, v1…vn").required();
  probe.option("--mode", request.mode, "separable or coupled").one_of({"separable", "coupled"});
  probe.flag("--directional", request.directional, "directional drag, whatever the configuration says");
  probe.option("--out", request.out, "CSV to write").required();
  probe.option("--skin", request.skin, "CSV to write the skin's sensors to");
}

std::vector<ProbeRow> read_probe_rows(std::istream& csv, const std::string& name,
                                      const std::vector<robot::Joint>& joints) {
  const std::size_t joint_count = joints.size();
  std::vector<ProbeRow> rows;
  std::string line;
  if (!std::getline(csv, line)) throw ConfigError(name + ":1: is empty; a header line is needed");
  const std::vector<std::string> columns = core::cells_of(line);
  check_header(columns, name + ":1: ", joint_count);
  for (int number = 2; std::getline(csv, line); ++number) {
    const std::string where = name + ":" + std::to_string(number) + ": ";
    const std::vector<std::string> cells = core::cells_of(line);
    if (cells.size() == 1 && cells[0].empty()) continue;
    if (cells.size() != columns.size()) {
      throw ConfigError(where + "has " + std::to_string(cells.size()) +
                        " values; allowed: " + std::to_string(columns.size()) + ", as the header");
    }
    ProbeRow row;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      double value = 0.0;
      const auto [end, error] = std::from_chars(cells[i].data(), cells[i].data() + cells[i].size(), value);
      if (error != std::errc() || end != cells[i].data() + cells[i].size() || !std::isfinite(value)) {
        throw ConfigError(where + columns[i] + ": '" + cells[i] + "' is not a finite number");
      }
      *place(row, columns[i], joint_count) = value;
    }
    for (std::size_t i = 0; i < joint_count; ++i) {
      const robot::Joint& joint = joints[i];
      if (robot::near_limits(row.position[i], joint.lower, joint.upper)) continue;
      throw ConfigError(fmt::format(
          "{}q{}: {:g} is beyond the limits of joint {}; allowed: {:.4g} to {:.4g} {}", where, i + 1,
          row.position[i], joint.name, joint.lower, joint.upper, robot::is_prismatic(joint) ? "m" : "rad"));
    }
    if (!rows.empty() && !(row.t_s >= rows.back().t_s)) throw ConfigError(where + "t: goes back in time");
    rows.push_back(row);
  }
  return rows;
}

ProbePeaks run_probe_rows(const PhantomModel& model, const PerceptSettings& settings,
                          const workspace::Workspace& workspace, const std::vector<ProbeRow>& rows,
                          const percept::AllowedContact& allowed, std::ostream& csv) {
  const std::size_t n = model.arm.joint_count();
  const auto header = [&](const char* name) {
    for (std::size_t i = 1; i <= n; ++i) csv << ',' << name << i;
  };
  csv << 't';
  header("tau");
  header("b");
  if (settings.directional.enabled) {
    header("bplus");
    header("bminus");
  }
  const ProbeColumns columns{settings.directional.enabled, !model.medium.empty(), !model.soft_bodies.empty()};
  if (columns.medium) header("drift");
  if (columns.soft) {
    header("reaction");
    header("stiffness");
  }
  csv << ",mu,link,sensor,object,x_m,y_m,z_m,pgvx_m,pgvy_m,pgvz_m,pgs,speed_m_s,motion,rule,time_to_contact_s,"
         "time_to_contact_error_s,gap_m,threats,greatest_mu,greatest_link,greatest_sensor,greatest_object\n";
  PhantomSensing sensing(model, settings);
  const SensedWorkspace sensed{&workspace, percept::greatest_neighbour_mu(workspace)};
  StepOutputs outputs;
  ProbePeaks peaks;
  double before_s = rows.empty() ? 0.0 : rows.front().t_s;
  for (const ProbeRow& row : rows) {
    sensing.step({row.position, row.velocity, row.t_s - before_s, sensed, true, allowed}, outputs);
    before_s = row.t_s;
    write_row(row, outputs, n, columns, csv);
    for (std::size_t i = 0; i < n; ++i) {
      peaks.speed[i] = std::max(peaks.speed[i], std::abs(row.velocity[i]));
      peaks.torque[i] = std::max(peaks.torque[i], std::abs(outputs.percept.drag_torque[i]));
    }
  }
  return peaks;
}

void write_skin(const PhantomModel& model, std::ostream& csv) {
  csv << "sensor,link,link_name,x_m,y_m,z_m,weight,area_m2,reach_vox,shape\n";
  static constexpr const char* kShapes[] = {"cube", "sphere", "sphere-contained",
                                            "fraction"};  // in ClusterShape's order
  for (std::size_t i = 0; i < model.skin.size(); ++i) {
    const std::size_t link = model.skin.link_of(i);
    csv << i << ',' << link << ',' << model.arm.links()[link].name << ',' << model.skin.x_m[i] << ','
        << model.skin.y_m[i] << ',' << model.skin.z_m[i] << ',' << model.skin.weight[i] << ','
        << model.skin.area_m2[i] << ',';
    const std::uint8_t kind = model.skin.cluster_kind[i];
    if (kind == 0) {
      csv << "0,point\n";
    } else {
      const robot::ClusterSpec& cluster = model.skin.clusters[kind - 1U];
      csv << cluster.reach_vox << ',' << kShapes[static_cast<std::size_t>(cluster.shape)] << '\n';
    }
  }
}

int run_probe(const ProbeRequest& request, Config config) {
  if (!request.arm.empty()) config.arm = request.arm;
  if (request.mode == "coupled") config.percept.mode = robot::DragMode::kCoupled;
  if (request.mode == "separable") config.percept.mode = robot::DragMode::kSeparable;
  if (request.directional) config.percept.directional.enabled = true;
  const runtime::CellConfig cell = runtime::load_checked_cell(request.cell);
  const PhantomModel model = load_model(cell, config);
  if (!request.skin.empty()) {
    std::ofstream skin = open_for_writing(request.skin);
    write_skin(model, skin);
    if (!skin.flush()) throw std::runtime_error(request.skin.string() + ": could not be written to the end");
  }
  const auto allowed = allowed_contact(cell, config, model);
  std::ifstream joints(request.joints);
  if (!joints) throw core::MissingError(request.joints.string() + ": no such file");
  const auto rows = read_probe_rows(joints, request.joints.string(), model.arm.joints());
  std::ofstream csv = open_for_writing(request.out);
  const auto start_ns = core::monotonic_ns();
  const workspace::Workspace workspace = build_workspace(cell);
  const auto built_ns = core::monotonic_ns();
  const ProbePeaks peaks = run_probe_rows(model, config.percept, workspace, rows, allowed, csv);
  if (!csv.flush()) throw std::runtime_error(request.out.string() + ": could not be written to the end");
  std::cout << rows.size() << " rows, " << model.skin.size() << " sensors; workspace built in "
            << core::seconds(built_ns - start_ns) << " s, sensed in "
            << core::seconds(core::monotonic_ns() - built_ns) << " s\n";
  if (const std::string beyond = beyond_drives(model.arm.joints(), peaks); !beyond.empty())
    spdlog::warn("{}: the drag is the model's, more than there is: {}", request.joints.string(), beyond);
  return 0;
}

}  // namespace phantom::phantom_sensing
