#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "common/runtime/process/command_line.hpp"
#include "components/phantom_sensing/config.hpp"

namespace phantom::phantom_sensing {

/// Arguments of `phantom_sensing probe`, which runs the component's own step on a file instead of on DDS
/// samples.
struct ProbeRequest {
  std::filesystem::path cell;
  std::string arm;  ///< empty: the configuration's
  std::filesystem::path joints;
  std::string mode;  ///< "separable", "coupled"; empty: the configuration's
  bool directional = false;
  std::filesystem::path out;
  std::filesystem::path skin;  ///< file to which the sensors are written too; empty: none
};

/// Declares the command's options on `probe`.
void add_options(runtime::Command probe, ProbeRequest& request);

/// A row of the joints file.
struct ProbeRow {
  double t_s = 0.0;
  core::JointArray position{}, velocity{};
};

/// Reads CSV with a header naming t, q1…qn and v1…vn, in any order. Throws ConfigError naming file, line and
/// column for unknown or missing columns, a joint count other than the arm's, a value that is not a finite
/// number, a position that the running component would refuse as beyond its joint's limits
/// (robot::near_limits), or a time that does not increase.
std::vector<ProbeRow> read_probe_rows(std::istream& csv, const std::string& name,
                                      const std::vector<robot::Joint>& joints);

/// Greatest magnitudes over all rows, joint by joint.
struct ProbePeaks {
  core::JointArray speed{};   ///< rad/s or m/s
  core::JointArray torque{};  ///< of the drag, N·m or N
};

/// Writes one row per input row: t, tau1…taun, b1…bn (coefficient for the direction of motion; with
/// directional drag also bplus and bminus), mu, link, sensor, object, x_m, y_m, z_m, pgvx_m, pgvy_m, pgvz_m,
/// pgs, speed_m_s, motion, rule. Returns the peaks.
ProbePeaks run_probe_rows(const PhantomModel& model, const PerceptSettings& settings,
                          const workspace::Workspace& workspace, const std::vector<ProbeRow>& rows,
                          const percept::AllowedContact& allowed, std::ostream& csv);

/// Writes every sensor: sensor, link, link_name, x_m, y_m, z_m (in the moving link's frame), weight (what μ
/// is multiplied by), area_m2, reach_vox (0: a point) and shape.
void write_skin(const PhantomModel& model, std::ostream& csv);

/// Runs the command. Returns the exit code; throws ConfigError and MissingError.
int run_probe(const ProbeRequest& request, Config config);

}  // namespace phantom::phantom_sensing
