#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "common/messages/pose_findings.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"
#include "components/synthetic_viewer/state/camera_control.hpp"
#include "components/synthetic_viewer/state/localized_text.hpp"
#include "components/synthetic_viewer/state/model_history.hpp"
#include "components/synthetic_viewer/state/stop_status.hpp"
#include "components/synthetic_viewer/state/synthetic_viewer.hpp"

namespace phantom::synthetic_viewer {

/// Ages beyond which received samples are out of date.
struct Staleness {
  double slave_s = 0.25;
  double percept_s = 0.5;
  double gripper_s = 0.5;
  double component_s = 2.0;  ///< status comes at 2 Hz
  double meshes_s = 5.0;     ///< from the first object on: meshes that are missing then are not waited for
};

/// An alert as listed on the page.
struct HitRecord {
  HitSample raised;
  double cleared_after_s = -1.0;  ///< −1: not cleared yet
};

/// Measures the share of slave_state samples that arrive, by their sequence numbers, over the last second or
/// so.
class LinkQuality {
 public:
  void take(const ArmSample& arm, core::Nanoseconds now_ns) noexcept;
  /// Returns the share 0…1; negative: not known yet.
  double share() const noexcept { return share_; }

 private:
  core::Nanoseconds since_ns_ = 0;
  std::uint64_t arrived_ = 0, lost_ = 0;
  double share_ = -1.0;
};

/// Another arm of the cell as it was last heard of.
struct OtherArmSample {
  std::string name;
  ArmSample arm;
};

/// The state of recording, as shown to the operator.
struct RecordingState {
  bool running = false;
  View view = View::kMain;
  std::string file;     ///< file of the running recording, or of the last one
  std::string problem;  ///< why the last recording could not start or ended; empty: nothing went wrong
  int frames = 0;       ///< frames written so far to that file
};

/// What is switched on now, for controls that toggle it.
struct ViewSwitches {
  bool hold = false, recording = false;
};

/// Everything the viewer knows at one moment. A plain value, used on the viewer's thread; pure.
struct ViewerState {
  ArmSample arm;
  PerceptSample percept;
  MasterSample master;
  GripperSample gripper;
  std::vector<OtherArmSample> others;  ///< as the configuration lists them
  SkinSample skin;
  WorkspaceSample workspace;
  LinkQuality link_quality;
  std::map<std::uint16_t, ObjectSample> objects;
  std::deque<HitRecord> hits;                                ///< newest last, at most kMaxHits
  std::map<std::uint16_t, UncertaintySample> uncertainties;  ///< of objects' poses, by their ids
  messages::PoseFindings findings;                           ///< of cameras
  std::map<std::uint16_t, LiveObjectSample> live;  ///< what cameras see and the model lacks, by their ids
  ModelHistory model_history;
  std::map<std::uint32_t, DoubtSample> doubts;        ///< of the model, by their places
  std::map<std::string, ComponentSample> components;  ///< by name, with the host where two share a name
  ViewNode chosen = ViewNode::kAutomatic;
  bool hold = false;
  bool approach = false;  ///< the way from the tool to the nearest object is asked for
  CameraControl cameras;
  RecordingState recording;
  StopView stops;
  std::uint64_t total_hits = 0;
  std::uint64_t forgotten = 0;            ///< components that made room for others
  core::Nanoseconds first_object_ns = 0;  ///< when the first object came; 0: none yet
  std::string graphics;                   ///< the renderer, as the driver calls it

  static constexpr std::size_t kMaxHits = 40;
  static constexpr std::size_t kMaxComponents = 256;  ///< the one silent longest makes room for a new one

  void take(const HitSample& hit);
  void take(ObjectSample object, core::Nanoseconds now_ns);
  void take(ComponentSample component);
  /// Takes a doubt of the model. Those of another phantom are forgotten with the first of a new one.
  void take(DoubtSample doubt);
  void take(FindingSample finding) { findings.take(std::move(finding)); }
  void take(LiveObjectSample object);
  /// Applies a view command; all others are ignored.
  void take(const Command& command);
  /// Returns by how much a point of an object may be off; 0: not stated.
  double pose_error_m(std::uint16_t id) const;
  /// Returns the findings by which an object does not stand where the model has it, and has not moved since.
  std::vector<const FindingSample*> displaced() const;
  /// Returns how an object is carried; null: no arm carries it.
  const messages::CarriedObject* carried(std::uint16_t id) const;
};

/// Returns the seconds since `received_ns`; infinite if nothing was received.
double age_s(core::Nanoseconds received_ns, core::Nanoseconds now_ns) noexcept;

/// Returns what must not be missed; empty if all is well: a stop, else two processes that send the same
/// topic, else condition_words().
LocalizedText banner_words(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns);
/// Returns what a picture must say in large letters: banner_words(), and of a stop in a second line who has
/// not confirmed it.
std::string banner_text(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns,
                        Language language = Language::kEnglish);

/// Returns what a doubt of the model says: "force of 12 N at gripper, 31 mm from gate_valve".
LocalizedText doubt_words(const ViewerState& state, const messages::ModelDoubt& doubt);
/// Returns what a camera has found of an object: "waste_drum stands 100 mm from where the model has it".
LocalizedText finding_words(const ViewerState& state, const FindingSample& finding);

/// Returns the most urgent of: slave lost or missing, an enabling switch released, link degraded, phantom
/// silent or without a valid model, a model that is in doubt. Empty if none applies.
LocalizedText condition_words(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns);

/// Returns whether hit zones are shown by themselves: not while a master that is heard says that the operator
/// works without these views.
bool shows_hits(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns);
/// Returns row and column of Table 6.1 in force: "Torque feedback, balanced arm (b1): drag and tone".
LocalizedText percepts_words(const ViewerState& state);

/// Returns the object's name, such as "table"; "object 7" if the name is not known; "free space" for 0; of
/// what is another arm, that arm's name.
LocalizedText object_words(const ViewerState& state, std::uint16_t id);
/// Returns a thing that cameras see and the model lacks in words; its own name counts for nothing if it is
/// that of its id.
LocalizedText live_words(std::uint16_t id, const std::string& name);
/// object_words() in English.
std::string object_name(const ViewerState& state, std::uint16_t id, Language language = Language::kEnglish);
/// Returns what the arm touches; "something unknown" if only its force is felt.
LocalizedText touched_object(const ViewerState& state);

/// Returns what arms carry, a sentence each: "arm left carries pump".
std::vector<LocalizedText> carried_words(const ViewerState& state);

/// Returns what the gripper does, in a few plain words: "holds something 42 mm wide with 30 N"; empty if
/// there is no gripper.
LocalizedText gripper_words(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns);

std::string label_of(LinkState state);  ///< "COUPLED"
const char* name_of(MotionClass motion) noexcept;
const char* name_of(HitRule rule) noexcept;
const char* label_of(core::ComponentState state) noexcept;  ///< "RUNNING"

}  // namespace phantom::synthetic_viewer
