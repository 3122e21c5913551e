#include "components/synthetic_viewer/state/state.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/messages/living.hpp"
#include "common/runtime/cell/other_arms.hpp"
#include "common/teleop/coupling/bilateral.hpp"
#include "common/teleop/coupling/counterbalance.hpp"

namespace phantom::synthetic_viewer {
namespace {

/// Returns the name of an enumerator that may have come from a message unchecked.
template <class Enumerator, std::size_t kCount>
const char* name_in(const char* const (&names)[kCount], Enumerator value) noexcept {
  const auto number = static_cast<std::size_t>(value);
  return number < kCount ? names[number] : "?";
}

}  // namespace

void ViewerState::take(const HitSample& hit) {
  const auto known = std::find_if(hits.rbegin(), hits.rend(), [&hit](const HitRecord& record) {
    return record.raised.alert == hit.alert;
  });
  if (hit.cleared) {
    if (known != hits.rend() && known->cleared_after_s < 0) {
      known->cleared_after_s = core::seconds(hit.received_ns - known->raised.received_ns);
    }
    return;
  }
  if (known != hits.rend() && known->cleared_after_s < 0) return;
  hits.push_back({hit, -1.0});
  ++total_hits;
  if (hits.size() > kMaxHits) hits.pop_front();
}

void ViewerState::take(ObjectSample object, core::Nanoseconds now_ns) {
  const std::uint16_t id = object.id;
  model_history.take(object);
  if (object.removed()) {
    objects.erase(id);
    return;
  }
  if (first_object_ns == 0) first_object_ns = now_ns;
  objects[id] = std::move(object);
}

void ViewerState::take(ComponentSample component) {
  std::string key = component.component + "@" + component.host;
  components[std::move(key)] = std::move(component);
  if (components.size() <= kMaxComponents) return;
  ++forgotten;
  components.erase(std::min_element(components.begin(), components.end(), [](const auto& a, const auto& b) {
    return a.second.received_ns < b.second.received_ns;
  }));
}

void ViewerState::take(LiveObjectSample object) {
  if (object.standing == messages::LiveStanding::kLost || !messages::is_live(object.id))
    live.erase(object.id);
  else
    live.insert_or_assign(object.id, std::move(object));
}

void ViewerState::take(DoubtSample doubt) {
  if (!doubts.empty() && doubts.begin()->second.stamp.session != doubt.stamp.session) doubts.clear();
  doubts[doubt.place] = std::move(doubt);
}

void ViewerState::take(const Command& command) {
  if (command.kind == CommandKind::kViewHold) hold = command.value != 0;
  if (command.kind == CommandKind::kViewNode)
    chosen = percept::node_from_number(command.value).value_or(ViewNode::kAutomatic);
}

double ViewerState::pose_error_m(std::uint16_t id) const {
  const auto found = uncertainties.find(id);
  return found != uncertainties.end() ? std::max(0.0, found->second.pose_error_m) : 0.0;
}

const messages::CarriedObject* ViewerState::carried(std::uint16_t id) const {
  const auto found = std::ranges::find(workspace.carried, id, &messages::CarriedObject::id);
  return found == workspace.carried.end() ? nullptr : &*found;
}

void LinkQuality::take(const ArmSample& arm, core::Nanoseconds now_ns) noexcept {
  if (since_ns_ != 0 && now_ns - since_ns_ < core::kNsPerSecond) return;
  const std::uint64_t arrived = arm.arrived - arrived_, lost = arm.lost - lost_;
  if (since_ns_ != 0) {
    share_ = arrived + lost == 0 ? 0.0 : static_cast<double>(arrived) / static_cast<double>(arrived + lost);
  }
  since_ns_ = now_ns;
  arrived_ = arm.arrived;
  lost_ = arm.lost;
}

double age_s(core::Nanoseconds received_ns, core::Nanoseconds now_ns) noexcept {
  return received_ns == 0 ? std::numeric_limits<double>::infinity() : core::seconds(now_ns - received_ns);
}

LocalizedText banner_words(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) {
  const StopView& stops = state.stops;
  if (stops.in_force) return stops.headline_words;
  return stops.notice_words.empty() ? condition_words(state, staleness, now_ns) : stops.notice_words.front();
}

std::string banner_text(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns,
                        Language language) {
  const std::string said = in(language, banner_words(state, staleness, now_ns));
  return state.stops.in_force ? said + "\n" + sides_text(state.stops, language) : said;
}

LocalizedText condition_words(const ViewerState& state, const Staleness& staleness,
                              core::Nanoseconds now_ns) {
  const double slave_age_s = age_s(state.arm.received_ns, now_ns);
  if (state.arm.received_ns == 0) return {"banner.no_slave", {}};
  if (slave_age_s > staleness.slave_s)
    return {"banner.link_lost", {{"age_s", std::floor(slave_age_s * 10) / 10}}};
  const bool master_permits =
      state.master.motion_permitted || age_s(state.master.received_ns, now_ns) > staleness.slave_s;
  if (state.arm.state != LinkState::kStopped && !(state.arm.motion_permitted && master_permits))
    return {"banner.switch_released", {}};
  if (state.arm.state == LinkState::kDegraded) return {"banner.link_degraded", {}};
  if (age_s(state.percept.received_ns, now_ns) > staleness.percept_s) return {"banner.phantom_silent", {}};
  if (!state.percept.valid) return {"banner.no_model", {}};
  const messages::ModelDoubt* newest = nullptr;
  for (const auto& [place, doubt] : state.doubts)
    if (doubt.holds && (newest == nullptr || doubt.doubt > newest->doubt)) newest = &doubt;
  if (newest != nullptr) return {"banner.model_in_doubt", {{"what", doubt_words(state, *newest)}}};
  for (const FindingSample* finding : state.displaced())
    if (finding->id == state.percept.object)
      return {"banner.model_in_doubt", {{"what", finding_words(state, *finding)}}};
  return {};
}

std::vector<const FindingSample*> ViewerState::displaced() const {
  std::vector<const FindingSample*> all;
  for (const auto& [id, finding] : findings.all()) {
    const auto object = objects.find(id);
    if (object != objects.end() && carried(id) == nullptr &&
        findings.displacing(id, object->second.X_WO) != nullptr)
      all.push_back(&finding);
  }
  return all;
}

LocalizedText finding_words(const ViewerState& state, const FindingSample& finding) {
  const LocalizedText::Value object{"object", object_words(state, finding.id)},
      camera{"camera", finding.camera}, shift{"shift_mm", 1e3 * finding.shift_m};
  if (finding.verdict == messages::PoseVerdict::kGone) return {"finding.gone", {object, camera}};
  if (finding.verdict == messages::PoseVerdict::kUnclear) return {"finding.unclear", {object, camera}};
  return {"finding.elsewhere", {object, camera, shift}};
}

LocalizedText doubt_words(const ViewerState& state, const messages::ModelDoubt& doubt) {
  const LocalizedText::Value link{"link", doubt.link_name},
      object{"object", object_words(state, doubt.object)},
      residual{"residual_mm", 1e3 * std::abs(doubt.residual_m)};
  if (doubt.kind == percept::DoubtKind::kNoForceInside)
    return {"doubt.no_force_inside", {link, object, residual}};
  const LocalizedText force = doubt.force_N >= 0.0
                                  ? LocalizedText{"doubt.force", {{"force_N", doubt.force_N}}}
                                  : LocalizedText{"doubt.some_force", {}};
  const LocalizedText where{doubt.located ? "doubt.at_link" : "doubt.behind_link", {link}};
  if (!doubt.residual_known) return {"doubt.in_free_space", {{"force", force}, {"where", where}}};
  return {"doubt.off_object", {{"force", force}, {"where", where}, object, residual}};
}

bool shows_hits(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) {
  return state.master.views_enabled || age_s(state.master.received_ns, now_ns) > staleness.slave_s;
}

namespace {

/// Returns the key of a row of Table 6.1 (teleop::percept_set).
const char* percept_row_key(teleop::BilateralLaw law, teleop::Counterbalance counterbalance) noexcept {
  using enum teleop::BilateralLaw;
  switch (law) {
    case kPf:
      return "percept_row.position_forward";
    case kSctfb:
      return counterbalance == teleop::Counterbalance::kNone        ? "percept_row.torque_weight_felt"
             : counterbalance == teleop::Counterbalance::kAutomatic ? "percept_row.torque_counterbalanced"
                                                                    : "percept_row.torque_balanced";
    case kPfff:
      return "percept_row.force";
    case kPe:
      return "percept_row.exchange";
    case kPeff:
      return "percept_row.exchange_force";
  }
  return "";
}

}  // namespace

LocalizedText percepts_words(const ViewerState& state) {
  const MasterSample& master = state.master;
  const int chosen = (master.percept_enabled ? 1 : 0) + (master.tone_enabled ? 2 : 0) +
                     (master.views_enabled ? 4 : 0);  // the bits of set_percepts
  return {"percept.in_force",
          {{"row", LocalizedText{percept_row_key(master.law, state.arm.counterbalance), {}}},
           {"chosen", LocalizedText{std::string("percept_chosen.").append(std::to_string(chosen)), {}}}}};
}

LocalizedText live_words(std::uint16_t id, const std::string& name) {
  if (name != messages::live_name(id)) return {"object.named", {{"name", name}}};
  if (id == messages::kLiveId) return {"object.live", {}};
  return {"object.live_numbered", {{"number", static_cast<double>(id - messages::kFirstLiveObjectId + 1)}}};
}

LocalizedText object_words(const ViewerState& state, std::uint16_t id) {
  if (id == 0) return {"object.free_space", {}};
  const auto found = state.objects.find(id);
  if (const auto other = static_cast<std::size_t>(id - runtime::kFirstOtherArmId);
      id >= runtime::kFirstOtherArmId && other < state.others.size())
    return {"object.named", {{"name", state.others[other].name}}};
  // Its marker comes after the fluid is felt, and may go before.
  if (messages::is_live(id))
    return live_words(id, found == state.objects.end() ? messages::live_name(id) : found->second.name);
  if (found == state.objects.end() || found->second.name.empty())
    return {"object.numbered", {{"id", static_cast<double>(id)}}};
  return {"object.named", {{"name", found->second.name}}};
}

std::string object_name(const ViewerState& state, std::uint16_t id, Language language) {
  return in(language, object_words(state, id));
}

LocalizedText touched_object(const ViewerState& state) {
  if (!state.arm.contact) return object_words(state, 0);
  return state.arm.contact_object == 0 ? LocalizedText{"object.unknown", {}}
                                       : object_words(state, state.arm.contact_object);
}

std::vector<LocalizedText> carried_words(const ViewerState& state) {
  std::vector<LocalizedText> words;
  for (const messages::CarriedObject& carried : state.workspace.carried)
    words.push_back({"carry.carries", {{"arm", carried.arm}, {"object", object_words(state, carried.id)}}});
  return words;
}

LocalizedText gripper_words(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) {
  const GripperSample& gripper = state.gripper;
  if (gripper.received_ns == 0) return {};
  if (const double age = age_s(gripper.received_ns, now_ns); age > staleness.gripper_s)
    return {gripper.holds ? "gripper_state.silent_holding" : "gripper_state.silent",
            {{"age_s", std::floor(age * 10) / 10}}};
  const LocalizedText::Value width{"width_mm", std::abs(gripper.sense.width_m) * 1e3};
  if (gripper.sense.fault) return {gripper.holds ? "gripper_state.fault_holding" : "gripper_state.fault", {}};
  if (!gripper.sense.known) return {"gripper_state.not_reported", {}};
  if (!gripper.sense.follows) return {"gripper_state.not_ready", {width}};
  if (gripper.holds) return {"gripper_state.holds", {width, {"force_N", std::abs(gripper.sense.force_N)}}};
  if (gripper.moves)
    return {gripper.sense.velocity_m_s > 0 ? "gripper_state.opens" : "gripper_state.closes", {width}};
  return {gripper.open     ? "gripper_state.open"
          : gripper.closed ? "gripper_state.closed"
                           : "gripper_state.at_rest",
          {width}};
}

std::string label_of(LinkState state) {
  std::string label = teleop::name_of(state);
  std::transform(label.begin(), label.end(), label.begin(), [](char c) { return c & ~0x20; });
  return label;
}

const char* name_of(MotionClass motion) noexcept {
  return name_in({"none", "safe", "neutral", "dangerous"}, motion);
}

const char* name_of(HitRule rule) noexcept {
  return name_in({"none", "very_close", "moderate_moving", "far_nearing"}, rule);
}

const char* label_of(core::ComponentState state) noexcept {
  return name_in({"STARTING", "READY", "RUNNING", "DEGRADED", "STOPPED", "FAULT"}, state);
}

}  // namespace phantom::synthetic_viewer
