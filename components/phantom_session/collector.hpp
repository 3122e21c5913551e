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
#include "common/messages/percept.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/teleop/rendering/percept_set.hpp"
#include "components/phantom_session/alarm_count.hpp"

namespace phantom::phantom_session {

// Times are seconds since the session began.

/// A hit alert, in the words of the report.
struct HitSample {
  double t_s = 0.0;
  std::uint32_t alert = 0;
  std::string rule, link;
  std::string point;  ///< threatened interest point; empty: the link's skin
  int object = 0;
  bool cleared = false;
  bool asks = false;  ///< AlarmCount::asks() when it was raised

  /// Returns "gripper", or "forearm (elbow)" for an interest point.
  std::string place() const { return point.empty() ? link : link + " (" + point + ")"; }
};
struct StatusSample {
  double t_s = 0.0;
  std::string component;
  core::ComponentState state = core::ComponentState::kStarting;
  std::string message;
  std::vector<core::LoopStatistics> loops;
  std::map<std::string, std::uint64_t> deadline_missed;  ///< by topic, summed over this component's endpoints
  std::map<std::string, double> figures;
  std::string page;  ///< address of a page that the component serves on this host; empty: none
};

/// One reach of the operator into the cell.
struct Reach {
  int number = 0;
  bool percept = false;
  bool percept_missing = false;  ///< it was on, and phantom_sensing had none to give: counts as neither
  double start_s = 0.0;
  std::optional<double> onset_distance_m;  ///< clearance when the percept torque rose above the threshold
  double peak_torque_Nm = 0.0;             ///< greatest percept torque before contact
  std::optional<double> contact_s;
  double contact_speed_m_s = 0.0;  ///< tool speed in the last sample before the contact
  int contact_object = 0;
  std::size_t alarms = 0;  ///< entries that the operator's page began in its alarm list
};

/// Row and column of Table 6.1 that are in force: the operator's choice, whatever a script of reaches tries.
struct PerceptsInForce {
  teleop::BilateralLaw law = teleop::BilateralLaw::kPf;
  teleop::Counterbalance counterbalance = teleop::Counterbalance::kMechanical;
  teleop::PerceptChoice choice;

  /// Returns "b2: SCTFB, counterbalanced: drag, tone and views".
  std::string words() const {
    return std::string(teleop::percept_set(law, counterbalance).row) + ": " + teleop::words_of(choice);
  }
  friend bool operator==(const PerceptsInForce&, const PerceptsInForce&) = default;
};
/// They, and since when.
struct PerceptPeriod {
  double t_s = 0.0;
  PerceptsInForce percepts;
};

/// A process that wrote a topic while another one that writes it was followed. Its samples are in no figure.
struct ForeignWriter {
  double t_s = 0.0;   ///< when its first sample came
  std::string topic;  ///< e.g. "master_state"
  std::string
      process;  ///< e.g. "master_io on console"; "a process without status": none of its own was heard
  std::uint64_t samples = 0;  ///< of others on this topic that were left out
};

/// One row of the time series, which has the collector's own interval.
struct Row {
  double t_s = 0.0;
  int reach = -1;
  bool percept_enabled = false;
  double clearance_m = -1.0;
  // Greatest magnitudes over the joints (prismatic: N).
  double percept_torque_Nm = 0.0, feedback_torque_Nm = 0.0, operator_torque_Nm = 0.0;
  double mu_Pa_s_per_m = 0.0, closeness = 0.0, tool_speed_m_s = 0.0, contact_force_N = 0.0;
};

/// Computes a session's figures from the topics' samples. Pure: no DDS, clock or file. Not thread-safe.
class Collector {
 public:
  using Narrate = std::function<void(const std::string&)>;
  /// Greatest numbers of components, and of reaches and hits that are kept. Further hits are told, not kept;
  /// of the components the one that was silent longest is forgotten.
  static constexpr std::size_t kMaxComponents = 256, kMaxEvents = 100'000;
  static constexpr double kSameHit_s = 0.25;

  /// What came beyond these numbers, and is in no figure.
  struct Forgotten {
    std::uint64_t components = 0, reaches = 0, hits = 0;
  };

  /// `onset_threshold_Nm`: percept torque that counts as felt. `row_interval_s`: spacing of the time series.
  /// `narrate`: called with one line for each event; may be empty. The line of a hit, and those after it,
  /// wait for kSameHit_s, because the skin and the interest points of a link report the same hit one after
  /// the other.
  Collector(double onset_threshold_Nm, double row_interval_s, Narrate narrate);

  void on_object_name(int object, const std::string& name) { object_names_[object] = name; }
  /// Sets the names of the arm's links, by link index. Without them links are shown by number.
  void on_link_names(std::vector<std::string> names) { link_names_ = std::move(names); }
  void on_master(double t_s, const messages::MasterState& state);
  void on_slave(double t_s, const messages::SlaveState& state);
  void on_percepts(double t_s, const PerceptsInForce& percepts);
  void on_percept(double t_s, const messages::Percept& percept);
  void on_hit(const HitSample& sample);
  void on_status(const StatusSample& sample);
  /// `process` writes `topic` beside the process that is followed; `samples` of others were left out so far.
  void on_foreign_writer(double t_s, const std::string& topic, const std::string& process,
                         std::uint64_t samples);

  /// Narrates the lines that still wait.
  void narrate_rest() { narrate_until(std::numeric_limits<double>::infinity()); }

  const std::vector<Reach>& reaches() const { return reaches_; }
  const std::vector<PerceptPeriod>& percept_periods() const { return percept_periods_; }
  const AlarmCount& alarms() const { return alarms_; }
  const std::vector<Row>& rows() const { return rows_; }
  const std::vector<HitSample>& hits() const { return hits_; }  ///< raised alerts only
  const std::map<std::string, StatusSample>& statuses() const { return statuses_; }
  const std::vector<ForeignWriter>& foreign_writers() const {
    return foreign_writers_;
  }  ///< up to kMaxComponents
  const Forgotten& forgotten() const { return forgotten_; }
  std::string object_name(int object) const;
  /// Returns what is felt now, in two lines: drag per joint; the percept, motion class and age of the model.
  std::string live_line() const;
  /// Returns whether each of `components` has reported to be ready or running; otherwise names the rest in
  /// `missing`.
  bool all_ready(const std::vector<std::string>& components, std::string* missing) const;
  /// Returns the address of the operator's page; empty while no component has reported one.
  std::string page() const;
  /// Returns whether master_io or slave_io reports that a stop is in force.
  bool any_stopped() const;

 private:
  /// A line that waits to be narrated: an event, or a hit with the places that have reported it.
  struct Line {
    double t_s = 0.0;
    std::string what;
    std::optional<HitSample> hit{};
    std::vector<std::string> places{};
  };
  void count_alarms(std::size_t begun);
  void narrate(double t_s, const std::string& what);
  void narrate_hit(const HitSample& sample);
  void narrate_until(double now_s);
  std::string text_of(const Line& line) const;
  bool has_percept() const { return percept_ && percept_->valid; }
  void begin_reach(double t_s, const messages::MasterState& state);
  void add_row(double t_s);

  double onset_threshold_Nm_, row_interval_s_;
  Narrate narrate_;
  std::map<int, std::string> object_names_;
  std::vector<std::string> link_names_;
  messages::MasterState master_;
  messages::SlaveState slave_;
  std::optional<messages::Percept> percept_;
  std::vector<Reach> reaches_;
  std::vector<PerceptPeriod> percept_periods_;  // up to kMaxEvents
  std::vector<Row> rows_;
  std::vector<HitSample> hits_;
  AlarmCount alarms_;
  std::deque<Line> waiting_;  // the first one is a hit's
  std::map<std::string, StatusSample> statuses_;
  std::vector<ForeignWriter> foreign_writers_;
  Forgotten forgotten_;
  int forgotten_reach_ = -1;                  // number of the last one that was not kept
  std::map<std::string, double> narrated_s_;  // when a component's message was last narrated; of statuses_
};

}  // namespace phantom::phantom_session
