#include "components/phantom_session/joint_log.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

namespace phantom::phantom_session {

void JointLog::on_master(std::size_t joint_count, JointRow row) {
  if (!slave_position_) return;
  if (!rows_.empty() && row.t_s - rows_.back().t_s < row_interval_s_) return;
  joint_count_ = std::min<std::size_t>(joint_count, core::kMaxJoints);
  row.slave_position = *slave_position_;
  rows_.push_back(std::move(row));
}

std::optional<std::size_t> JointLog::most_telling() const {
  if (rows_.empty() || joint_count_ == 0) return std::nullopt;
  // Work of percept and feedback, |τ|·|Δq|: comparable between revolute and prismatic joints.
  core::JointArray work_J{};
  for (std::size_t i = 1; i < rows_.size(); ++i) {
    for (std::size_t j = 0; j < joint_count_; ++j) {
      const double moved = std::abs(rows_[i].master_position[j] - rows_[i - 1].master_position[j]);
      work_J[j] += moved * (std::abs(rows_[i].percept_torque[j]) + std::abs(rows_[i].feedback_torque[j]));
    }
  }
  const auto end = work_J.begin() + static_cast<std::ptrdiff_t>(joint_count_);
  return static_cast<std::size_t>(std::max_element(work_J.begin(), end) - work_J.begin());
}

void JointLog::write(const std::filesystem::path& folder) const {
  std::ofstream file(folder / "joints.csv");
  if (!file) throw std::runtime_error((folder / "joints.csv").string() + ": cannot be written");
  file << "t_s,reach,law";
  for (std::size_t j = 1; j <= joint_count_; ++j) {
    for (const char* what : {"master", "slave", "operator", "percept", "feedback"}) file << ',' << what << j;
  }
  file << '\n';
  for (const JointRow& row : rows_) {
    file << row.t_s << ',' << row.reach << ',' << row.law;
    for (std::size_t j = 0; j < joint_count_; ++j) {
      file << ',' << row.master_position[j] << ',' << row.slave_position[j] << ',' << row.operator_torque[j]
           << ',' << row.percept_torque[j] << ',' << row.feedback_torque[j];
    }
    file << '\n';
  }
}

}  // namespace phantom::phantom_session
