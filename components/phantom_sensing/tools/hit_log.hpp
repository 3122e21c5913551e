#pragma once

#include <array>
#include <functional>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "components/phantom_sensing/sensing_loop.hpp"

namespace phantom::phantom_sensing {

/// Returns what a doubt says, in one line: "force of 12.0 N at gripper, 31 mm from gate_valve".
std::string doubt_sentence(const percept::ModelDoubt& doubt, const std::string& link,
                           const std::string& object);

/// Passes everything on to another sink and keeps alerts and doubts for log and report. Another thread writes
/// the log, so that a blocked log cannot delay the next alert.
class HitLog : public PerceptSink {
 public:
  using ObjectName = std::function<std::string(std::uint16_t)>;
  /// Both must outlive this.
  HitLog(PerceptSink& next, const PhantomModel& model);

  void on_drag(const StepOutputs& outputs, const TickInfo& info) override { next_.on_drag(outputs, info); }
  void on_percept(const StepOutputs& outputs, const TickInfo& info) override {
    next_.on_percept(outputs, info);
  }
  void on_alert(const percept::Alert& alert, bool cleared) override;
  void on_doubt(const percept::ModelDoubt& doubt, bool holds) override;

  /// Logs the alerts that came since the last call. Call it on the same thread as json().
  void log_new(const ObjectName& object_name);
  /// Returns [{t, alert, link, object, rule, mu, speed_m_s, time_to_contact_s, gap_m, point, cleared_t}] for
  /// the first 10,000 alerts.
  nlohmann::ordered_json json(const ObjectName& object_name);
  /// Returns [{t, doubt, kind, link, object, position_m, located, force_N, residual_m, held_s}] for the first
  /// 1,000 doubts.
  nlohmann::ordered_json doubts_json(const ObjectName& object_name);
  /// Returns what the newest doubt that holds says; empty: none holds.
  std::string doubt_in_force(const ObjectName& object_name);

 private:
  /// An alert as report and log show it.
  struct Record {
    percept::Alert alert;
    double raised_s = 0.0;
    double cleared_s = -1.0;  ///< −1: not yet
  };
  struct DoubtRecord {
    percept::ModelDoubt doubt;
    double raised_s = 0.0;
    double held_s = -1.0;  ///< −1: it holds
  };
  std::optional<Record> record(std::size_t index);
  std::optional<DoubtRecord> doubt_record(std::size_t index);
  std::string sentence_of(const percept::ModelDoubt& doubt, const ObjectName& object_name) const;
  std::string place_of(const percept::Alert& alert) const;

  PerceptSink& next_;
  const PhantomModel& model_;
  core::Nanoseconds start_ns_ = core::monotonic_ns();
  std::mutex mutex_;
  std::vector<Record> records_;
  std::vector<DoubtRecord> doubts_;
  std::array<std::optional<percept::ModelDoubt>, percept::kDoubtKinds> in_force_;
  std::size_t logged_ = 0, doubts_logged_ = 0;  // used on the logging thread only
};

}  // namespace phantom::phantom_sensing
