#pragma once

#include <functional>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "components/phantom_sensing/sensing_loop.hpp"

namespace phantom::phantom_sensing {

/// Passes everything on to another sink and keeps the alerts for log and report. Another thread writes the
/// log, so that a blocked log cannot delay the next alert.
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

  /// Logs the alerts that came since the last call. Call it on the same thread as json().
  void log_new(const ObjectName& object_name);
  /// Returns [{t, alert, link, object, rule, mu, speed_m_s, time_to_contact_s, gap_m, point, cleared_t}] for
  /// the first 10,000 alerts.
  nlohmann::ordered_json json(const ObjectName& object_name);

 private:
  /// An alert as report and log show it.
  struct Record {
    percept::Alert alert;
    double raised_s = 0.0;
    double cleared_s = -1.0;  ///< −1: not yet
  };
  std::optional<Record> record(std::size_t index);
  std::string place_of(const percept::Alert& alert) const;

  PerceptSink& next_;
  const PhantomModel& model_;
  core::Nanoseconds start_ns_ = core::monotonic_ns();
  std::mutex mutex_;
  std::vector<Record> records_;
  std::size_t logged_ = 0;  // used on the logging thread only
};

}  // namespace phantom::phantom_sensing
