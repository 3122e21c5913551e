#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/joints.hpp"

namespace phantom::phantom_session {

/// One sample of master and slave by joint, for the plots of a bilateral law. rad or m, N·m or N by type of
/// joint.
struct JointRow {
  double t_s = 0.0;
  int reach = -1;
  std::string law;
  core::JointArray master_position{}, slave_position{};
  core::JointArray operator_torque{};  ///< torque that the hand exerts (MLT with the velocity servo)
  core::JointArray percept_torque{};   ///< PFFB
  core::JointArray feedback_torque{};  ///< SFFB; SCTFB in case b
};

/// Collects rows at an interval of its own. Pure; not thread-safe.
class JointLog {
 public:
  explicit JointLog(double row_interval_s) : row_interval_s_(row_interval_s) {}

  void on_slave(const core::JointArray& position) { slave_position_ = position; }
  /// Adds a row if the interval is over. Rows begin once the slave has been heard.
  void on_master(std::size_t joint_count, JointRow row);

  const std::vector<JointRow>& rows() const { return rows_; }
  std::size_t joint_count() const { return joint_count_; }
  /// Returns the joint on which percept and feedback did the most work: the most interesting one. None
  /// without rows.
  std::optional<std::size_t> most_telling() const;
  /// Writes joints.csv: t_s, reach, law, then per joint master, slave, operator, percept, feedback. Throws
  /// std::runtime_error if it cannot be written.
  void write(const std::filesystem::path& folder) const;

 private:
  double row_interval_s_;
  std::size_t joint_count_ = 0;
  std::optional<core::JointArray> slave_position_;
  std::vector<JointRow> rows_;
};

}  // namespace phantom::phantom_session
