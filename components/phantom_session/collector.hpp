#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/health.hpp"

namespace phantom::phantom_session {

/// What the collector needs of each topic, in SI units. Times are seconds since the session began.
struct MasterSample {
  double t_s = 0.0;
  int reach = -1;
  bool percept_enabled = false;
  double percept_torque_Nm = 0.0;   ///< greatest magnitude over the joints (prismatic: N)
  double feedback_torque_Nm = 0.0;  ///< likewise
  double operator_torque_Nm = 0.0;  ///< likewise
  double round_trip_s = -1.0;       ///< −1: none with this sample
};
struct SlaveSample {
  double t_s = 0.0;
  bool contact = false;
  double contact_force_N = 0.0;
  int contact_object = 0;
  double tool_speed_m_s = 0.0;
  double clearance_m = -1.0;  ///< −1: unknown or out of range
};
struct PerceptSample {
  double t_s = 0.0;
  bool valid = false;
  double mu_Pa_s_per_m = 0.0;
  double closeness = 0.0;
  std::size_t link = 0;        ///< that carries the worst sensor
  int object = 0;              ///< whose fluid it meets
  std::string motion;          ///< its class: "leaving", "passing", "nearing"; empty: none
  std::vector<double> torque;  ///< drag per joint, N·m or N
  std::size_t muted_sensors = 0;
};
struct HitSample {
  double t_s = 0.0;
  std::uint32_t alert = 0;
  std::string rule, link;
  std::string point;  ///< interest point that is threatened; empty: the link's skin
  int object = 0;
  bool cleared = false;

  /// "gripper", or "forearm (elbow)" for an interest point.
  std::string place() const { return point.empty() ? link : link + " (" + point + ")"; }
};
struct StatusSample {
  double t_s = 0.0;
  std::string component;
  core::ComponentState state = core::ComponentState::kStarting;
  std::string message;
  std::vector<core::LoopStatistics> loops;
  std::map<std::string, std::uint64_t> deadline_missed;  ///< by topic, this component's endpoints added up
  std::map<std::string, double> figures;
  std::string page;  ///< address of the page that it serves on this host; empty: none
};

/// One reach of the operator into the cell.
struct Reach {
  int number = 0;
  bool percept = false;
  double start_s = 0.0;
  std::optional<double> onset_distance_m;  ///< clearance when the percept torque rose above the threshold
  double peak_torque_Nm = 0.0;             ///< greatest percept torque before the contact
  std::optional<double> contact_s;
  double contact_speed_m_s = 0.0;  ///< of the tool, in the last sample before the contact
  int contact_object = 0;
};

/// A row of the time series, taken at the collector's own interval.
struct Row {
  double t_s = 0.0;
  int reach = -1;
  bool percept_enabled = false;
  double clearance_m = -1.0, percept_torque_Nm = 0.0, feedback_torque_Nm = 0.0, operator_torque_Nm = 0.0;
  double mu_Pa_s_per_m = 0.0, closeness = 0.0, tool_speed_m_s = 0.0, contact_force_N = 0.0;
};

/// Turns what the topics say into the figures of a session. Pure: no DDS, clock or file. Not thread-safe.
class Collector {
 public:
  using Narrate = std::function<void(const std::string&)>;
  static constexpr double kSameHit_s = 0.25;

  /// `onset_threshold_Nm`: percept torque that counts as felt. `row_interval_s`: spacing of the time series.
  /// `narrate` is told in one line what happens; may be empty. A hit's line, and what follows it, waits for
  /// kSameHit_s: the skin and an interest point of one link tell the same hit one after the other.
  Collector(double onset_threshold_Nm, double row_interval_s, Narrate narrate);

  void on_object_name(int object, const std::string& name) { object_names_[object] = name; }
  /// Of the arm, by link index; without it links are called by their numbers.
  void on_link_names(std::vector<std::string> names) { link_names_ = std::move(names); }
  void on_master(const MasterSample& sample);
  void on_slave(const SlaveSample& sample);
  void on_percept(const PerceptSample& sample);
  void on_hit(const HitSample& sample);
  void on_status(const StatusSample& sample);

  /// Tells what still waits to be told.
  void narrate_rest() { narrate_until(std::numeric_limits<double>::infinity()); }

  const std::vector<Reach>& reaches() const { return reaches_; }
  const std::vector<Row>& rows() const { return rows_; }
  const std::vector<HitSample>& hits() const { return hits_; }  ///< raised ones only
  const std::map<std::string, StatusSample>& statuses() const { return statuses_; }
  std::string object_name(int object) const;
  /// What is felt now, in a line: drag per joint, worst sensor, motion class, age of the model.
  std::string live_line() const;
  /// Whether every one of `components` has reported to be ready or running.
  bool all_ready(const std::vector<std::string>& components, std::string* missing) const;
  /// Address of the operator's page; empty while no component has told one.
  std::string page() const;
  /// Whether master or slave say that a stop is in force.
  bool any_stopped() const;

 private:
  /// A line that waits: what happened, or the places of a hit that begin it.
  struct Line {
    double t_s = 0.0;
    std::string what;
    std::optional<HitSample> hit{};
    std::vector<std::string> places{};
  };
  void narrate(double t_s, const std::string& what);
  void narrate_hit(const HitSample& sample);
  void narrate_until(double now_s);
  std::string text_of(const Line& line) const;
  void begin_reach(const MasterSample& sample);
  void add_row(double t_s);

  double onset_threshold_Nm_, row_interval_s_;
  Narrate narrate_;
  std::map<int, std::string> object_names_;
  std::vector<std::string> link_names_;
  MasterSample master_;
  SlaveSample slave_;
  PerceptSample percept_;
  std::vector<Reach> reaches_;
  std::vector<Row> rows_;
  std::vector<HitSample> hits_;
  std::deque<Line> waiting_;  // the first is a hit's
  std::map<std::string, StatusSample> statuses_;
  std::map<std::string, double> told_s_;  // when a component's message was last told
};

}  // namespace phantom::phantom_session
