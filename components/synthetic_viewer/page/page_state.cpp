#include "components/synthetic_viewer/page/page_state.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "common/core/text.hpp"
#include "common/messages/living.hpp"
#include "components/synthetic_viewer/scene/hud.hpp"
#include "components/synthetic_viewer/state/delay_stages.hpp"
#include "components/synthetic_viewer/state/hand_limits.hpp"
#include "components/synthetic_viewer/state/view_direction.hpp"

namespace phantom::synthetic_viewer {
namespace {

using Json = nlohmann::json;

/// A number to six decimals, or to one of so many parts, so that it is short and seldom another one.
Json number_or_null(double value, bool known = true, double parts = 1e6) {
  return known && std::isfinite(value) ? Json(std::round(value * parts) / parts) : Json();
}
constexpr double kTenthsOfThousandths = 1e4, kThousandths = 1e3, kTenths = 10, kWhole = 1;

constexpr std::array kCounterbalanceNames{"none", "mechanical", "automatic"};  // of teleop::Counterbalance

Json link_json(const ViewerState& state, core::Nanoseconds now_ns) {
  const MasterSample& master = state.master;
  const bool master_known = master.received_ns != 0;
  const HeldBack held = held_back(state, now_ns);
  return {{"slave", state.arm.received_ns == 0 ? "NONE" : label_of(state.arm.state)},
          {"master", master_known ? label_of(master.state) : "NONE"},
          {"slave_age_s", number_or_null(age_s(state.arm.received_ns, now_ns))},
          {"master_age_s", number_or_null(age_s(master.received_ns, now_ns))},
          {"quality", number_or_null(state.link_quality.share(), state.link_quality.share() >= 0)},
          {"round_trip_s", number_or_null(master.round_trip_s, master.round_trip_s >= 0)},
          {"percept_gain", number_or_null(master.percept_gain, master_known)},
          {"feedback_gain", number_or_null(master.feedback_gain, master_known)},
          {"percept_enabled", master.percept_enabled},
          {"drag_chosen", master.drag_chosen},
          {"tone_enabled", master.tone_enabled},
          {"views_enabled", master.views_enabled},
          {"percept_set_automatic", master.percept_set_automatic},
          {"counterbalance", kCounterbalanceNames[static_cast<std::size_t>(state.arm.counterbalance)]},
          {"percepts", master_known ? english_text(percepts_words(state)) : ""},
          {"percepts_words", master_known ? json_of(percepts_words(state)) : Json()},
          {"percept_limited", held.percept_guarded},
          {"percept_capped", held.percept_capped},
          {"feedback_capped", held.feedback_capped},
          {"law", master_known ? Json(static_cast<int>(master.law)) : Json()},
          {"feedback_damped", master.feedback_damped},
          {"force_missing", master.force_missing},
          {"reach", master.reach},
          {"contact", state.arm.contact},
          {"contact_object", english_text(touched_object(state))},
          {"contact_object_words", json_of(touched_object(state))},
          {"contact_force_N", number_or_null(state.arm.contact_force_N, state.arm.contact_force_N >= 0)},
          {"tool_speed_m_s", number_or_null(state.arm.tool_speed_m_s)}};
}

Json seconds_or_null(double time_s) { return number_or_null(time_s, time_s >= 0, kThousandths); }

/// The most urgent threats, as many as a person takes in at once.
Json threats_json(const ViewerState& state, const CellScene& scene) {
  constexpr std::size_t kShown = 3;
  Json threats = Json::array();
  for (const messages::Threat& threat : state.percept.threats) {
    if (threats.size() == kShown) break;
    threats.push_back({{"link", scene.link_name(threat.link)},
                       {"object_words", json_of(object_words(state, threat.object))},
                       {"object_id", threat.object},
                       {"rule", name_of(threat.rule)},
                       {"contact_s", seconds_or_null(threat.contact.time_s)},
                       {"error_s", seconds_or_null(threat.contact.error_s)},
                       {"gap_m", seconds_or_null(threat.contact.gap_m)}});
  }
  return threats;
}

Json percept_json(const ViewerState& state, const CellScene& scene, const Staleness& staleness,
                  core::Nanoseconds now_ns) {
  const PerceptSample& percept = state.percept;
  const double age = age_s(percept.received_ns, now_ns);
  const bool known = percept.valid && age <= staleness.percept_s, near = known && percept.closeness > 0;
  return {{"known", known},
          {"age_s", number_or_null(age)},
          {"closeness", number_or_null(percept.closeness, known)},
          {"mu", number_or_null(percept.mu_Pa_s_per_m, known)},
          {"speed_m_s", number_or_null(percept.speed_m_s, known)},
          {"motion", known ? name_of(percept.motion) : "none"},
          {"link", near ? scene.link_name(percept.link) : std::string()},
          {"object", near ? object_name(state, percept.object) : std::string()},
          {"object_words", near ? json_of(object_words(state, percept.object)) : Json()},
          {"unseen", known && percept.condition == messages::PerceptCondition::kSpaceUnseen},
          {"threats", known ? threats_json(state, scene) : Json::array()},
          {"threat_count", known ? percept.threats.size() : 0}};
}

/// By what is told of a joint: what stays the same is then told once.
Json joints_json(const ViewerState& state, const CellScene& scene) {
  Json names = Json::array(), prismatic = names, percept_torques = names, feedback_torques = names;
  for (std::size_t i = 0; i < scene.arm().joint_count(); ++i) {
    const robot::Joint& joint = scene.arm().joints()[i];
    names.push_back(joint.name);
    prismatic.push_back(joint.type == robot::JointType::kPrismatic);
    percept_torques.push_back(number_or_null(state.master.percept_torque_Nm[i], true, kThousandths));
    feedback_torques.push_back(number_or_null(state.master.feedback_torque_Nm[i], true, kThousandths));
  }
  return {{"name", names},
          {"prismatic", prismatic},
          {"percept_torque", percept_torques},
          {"feedback_torque", feedback_torques}};
}

Json vector_json(const Vector3& v) {
  return {number_or_null(v[0], true, kThousandths), number_or_null(v[1], true, kThousandths),
          number_or_null(v[2], true, kThousandths)};
}

/// The stages of delay, each with its age and its budget.
Json delay_json(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) {
  Json stages = Json::object();
  for (const DelayStage& stage : delay_stages(state, staleness, now_ns))
    stages[stage.name] = {{"age_s", number_or_null(stage.age_s, stage.age_s >= 0, kTenthsOfThousandths)},
                          {"budget_s", stage.budget_s}};
  return stages;
}

/// From where each node looks, by its number.
Json directions_json(double main_azimuth_rad) {
  Json directions = Json::object();
  for (int number = 0; number <= percept::kNodeCount; ++number)
    directions[std::to_string(number)] =
        json_of(direction_words(static_cast<ViewNode>(number), main_azimuth_rad));
  return directions;
}

/// Null unless the way from the tool to an object is shown.
Json gap_json(const ViewerState& state, const HitView& view) {
  if (!view.approach) return {};
  return {{"object_words", json_of(object_words(state, view.approach->object))},
          {"gap_m", number_or_null(view.approach->gap_m, true, kTenthsOfThousandths)}};
}

/// By the place that an alert has among those that are kept: a newer one takes the oldest one's.
Json hits_json(const ViewerState& state, const CellScene& scene, core::Nanoseconds start_ns) {
  Json hits = Json::object();
  std::uint64_t number = state.total_hits - state.hits.size();
  for (const HitRecord& record : state.hits) {
    const HitSample& hit = record.raised;
    ++number;
    hits[std::to_string(number % ViewerState::kMaxHits)] = {
        {"number", number},
        {"alert", hit.alert},
        {"t", number_or_null(core::seconds(hit.received_ns - start_ns))},
        {"rule", name_of(hit.rule)},
        {"link", hit.link_name.empty() ? scene.link_name(hit.link) : hit.link_name},
        {"object", object_name(state, hit.object)},
        {"object_words", json_of(object_words(state, hit.object))},
        {"object_id", hit.object},
        {"contact_s", seconds_or_null(hit.contact.time_s)},
        {"at_m", vector_json(hit.look_at_m)},
        {"towards", vector_json(hit.pgv)},
        {"speed_m_s", number_or_null(hit.speed_m_s)},
        {"cleared_after_s", number_or_null(record.cleared_after_s, record.cleared_after_s >= 0)}};
  }
  return hits;
}

/// Null if there is no gripper.
Json gripper_json(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) {
  const GripperSample& gripper = state.gripper;
  if (gripper.received_ns == 0) return {};
  const double age = age_s(gripper.received_ns, now_ns);
  const bool known = gripper.sense.known && age <= staleness.gripper_s;
  const LocalizedText words = gripper_words(state, staleness, now_ns);
  return {{"words", english_text(words)},
          {"state_words", json_of(words)},
          {"age_s", number_or_null(age)},
          {"width_m", number_or_null(gripper.sense.width_m, known)},
          {"force_N", number_or_null(gripper.sense.force_N, known)},
          {"requested_width_m", gripper.requested_width_m},
          {"requested_force_N", gripper.requested_force_N},
          {"widest_m", gripper.widest_m},
          {"least_force_N", gripper.least_force_N},
          {"greatest_force_N", gripper.greatest_force_N},
          {"holds", known && gripper.holds},
          {"fault", gripper.sense.fault}};
}

/// Returns which views the operator has turned or zoomed.
Json moved_json(const CameraControl& cameras) {
  Json moved = Json::object();
  for (const View view : kViews) moved[name_of(view)] = !cameras.offset(view).at_home();
  return moved;
}

/// Returns whether a loop has not ticked for so long that its rate is out of date.
bool silent(const core::LoopStatistics& loop) {
  return loop.period_s > 0 && loop.idle_s > 1 + 3 * loop.period_s;
}

Json loops_json(const ComponentSample& component) {
  Json loops = Json::array();
  for (const core::LoopStatistics& loop : component.loops) {
    loops.push_back({{"name", loop.name},
                     {"rate_hz", number_or_null(loop.rate_hz, true, kTenths)},
                     {"p99_us", number_or_null(loop.wakeup_p99_us, true, kWhole)},
                     {"silent_s", number_or_null(loop.idle_s, silent(loop), kTenths)},
                     {"slips", loop.slips}});
  }
  return loops;
}

/// Returns the figure of that name; NaN if there is none.
double figure(const ComponentSample& component, std::string_view name) {
  const auto found = std::ranges::find(component.figures, name, &core::HealthFigure::name);
  return found != component.figures.end() ? found->value : std::nan("");
}

Json components_json(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) {
  Json components = Json::object();
  for (const auto& [key, component] : state.components) {
    const double age = age_s(component.received_ns, now_ns);
    const auto summed = [&component](std::uint64_t core::EndpointStatistics::*count) {
      std::uint64_t sum = 0;
      for (const core::EndpointStatistics& endpoint : component.topics) sum += endpoint.*count;
      return sum;
    };
    components[key] = {{"name", component.component},
                       {"host", component.host},
                       {"state", age > staleness.component_s ? "SILENT" : label_of(component.state)},
                       {"message", component.message},
                       {"simulated", figure(component, "simulated") == 1.0},
                       {"loops", loops_json(component)},
                       {"refused", summed(&core::EndpointStatistics::refused)},
                       {"deadline_missed", summed(&core::EndpointStatistics::deadline_missed)}};
  }
  return components;
}

/// Objects that do not stand where the model has them, by their names.
Json findings_json(const ViewerState& state) {
  Json findings = Json::object();
  for (const FindingSample* finding : state.displaced()) {
    const std::string& object = state.objects.at(finding->id).name;
    const bool elsewhere = finding->verdict == messages::PoseVerdict::kElsewhere;
    findings[object] = {{"what_words", json_of(finding_words(state, *finding))},
                        {"shift_m", number_or_null(finding->shift_m, elsewhere)},
                        {"turn_rad", number_or_null(finding->turn_rad, elsewhere)},
                        {"residual_m", number_or_null(finding->residual_m, elsewhere)},
                        {"unseen", finding->unseen}};
  }
  return findings;
}

/// What cameras see and the model lacks, by names.
Json live_json(const ViewerState& state) {
  Json things = Json::object();
  for (const auto& [id, thing] : state.live) {
    const char* const standing = thing.standing == messages::LiveStanding::kFrozen      ? "frozen"
                                 : thing.standing == messages::LiveStanding::kDiscarded ? "discarded"
                                                                                        : "tracked";
    const LocalizedText what{std::string("live.") + standing, {{"object", live_words(id, thing.name)}}};
    things[thing.name] = {{"standing", standing}, {"what_words", json_of(what)}};
  }
  return things;
}

constexpr std::array kLevelNames{"quiet", "waiting", "stopped", "alarm"};  // of SideView::Level

}  // namespace

std::string stop_json(const StopView& view) {
  Json sides = Json::object();
  for (const teleop::Side side : teleop::kSides) {
    const SideView& shown = view.sides[static_cast<std::size_t>(side)];
    sides[side == teleop::Side::kMaster ? "master" : "slave"] = {
        {"level", kLevelNames[static_cast<std::size_t>(shown.level)]},
        {"text", shown.text},
        {"text_words", json_of(shown.words)}};
  }
  const Json json{{"in_force", view.in_force},
                  {"alarm", view.alarm},
                  {"headline", view.headline},
                  {"headline_words", json_of(view.headline_words)},
                  {"sides", sides},
                  {"notices", view.notices},
                  {"notices_words", json_of(view.notice_words)}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

namespace {

/// Where the model was in doubt, by the doubts' places.
Json doubts_json(const ViewerState& state) {
  Json doubts = Json::object();
  for (const auto& [place, doubt] : state.doubts) {
    const double shift_m = eigen(doubt.shift_m).norm();
    doubts[std::to_string(place)] = {{"number", doubt.doubt},
                                     {"holds", doubt.holds},
                                     {"what_words", json_of(doubt_words(state, doubt))},
                                     {"object_words", json_of(object_words(state, doubt.object))},
                                     {"at_m", vector_json(doubt.position_m)},
                                     {"residual_m", number_or_null(doubt.residual_m, doubt.residual_known)},
                                     {"shift_m", number_or_null(shift_m, shift_m > 0.0)}};
  }
  return doubts;
}

/// The change of the model that would be undone; null: none.
Json undo_json(const ViewerState& state) {
  const ModelChange* const change = state.model_history.newest();
  if (change == nullptr) return {};
  const double moved_m = (change->after_WO.translation_m - change->before_WO.translation_m).norm();
  return {{"object", change->name}, {"moved_m", number_or_null(moved_m)}};
}

// What may be taken, and what is carried.
Json objects_json(const ViewerState& state, const CellScene& scene) {
  constexpr std::size_t kMax = 256;
  Json list = Json::array();
  for (const auto& [id, object] : state.objects) {
    if (list.size() < kMax && !object.name.empty() && !scene.zones.contains(id) && !messages::is_live(id))
      list.push_back({{"name", object.name}, {"carried", state.carried(id) != nullptr}});
  }
  return list;
}

/// Null if what is shown is live.
Json review_json(const PageFacts& facts) {
  if (!facts.review) return {};
  return {{"t", core::seconds(facts.review->at_ns - facts.start_ns)},
          {"utc_ms", facts.review->at_ns / 1'000'000},
          {"playing", facts.review->playing},
          {"rate", facts.review->rate}};
}

}  // namespace

nlohmann::json page_state(const ViewerState& state, const CellScene& scene, const HitView& view,
                          const Staleness& staleness, const PageFacts& facts, core::Nanoseconds now_ns) {
  const LocalizedText condition = condition_words(state, staleness, now_ns);
  const std::vector<LocalizedText> carried = carried_words(state);
  return {{"t", number_or_null(core::seconds(now_ns - facts.start_ns))},
          {"cell", facts.cell},
          {"banner", english_text(condition)},
          {"banner_words", json_of(condition)},
          {"link", link_json(state, now_ns)},
          {"percept", percept_json(state, scene, staleness, now_ns)},
          {"joints", joints_json(state, scene)},
          {"gripper", gripper_json(state, staleness, now_ns)},
          {"carried", core::listed(carried, english_text)},
          {"carried_words", json_of(carried)},
          {"objects", objects_json(state, scene)},
          {"hits", hits_json(state, scene, facts.start_ns)},
          {"total_hits", state.total_hits},
          {"components", components_json(state, staleness, now_ns)},
          {"view",
           {{"alert", view.alert},
            {"threatening", view.threatening},
            {"node", view.alert == 0 ? "" : percept::node_name(view.node)},
            {"direction_words",
             view.alert == 0 ? Json() : json_of(direction_words(view.node, facts.main_azimuth_rad))},
            {"directions", directions_json(facts.main_azimuth_rad)},
            {"main_azimuth_rad", number_or_null(facts.main_azimuth_rad)},
            {"chosen", static_cast<int>(state.chosen)},
            {"moved", moved_json(state.cameras)},
            {"hold", state.hold},
            {"approach", state.approach},
            {"gap", gap_json(state, view)}}},
          {"viewer",
           {{"frames_per_s", number_or_null(facts.frames_per_s)},
            {"graphics", facts.graphics},
            {"allow_commands", facts.allow_commands},
            {"tool_view", facts.tool_view},
            {"gauges_share", facts.gauges_share},
            {"camera", facts.camera},
            {"message", english_text(facts.message)},
            {"message_words", json_of(facts.message)}}},
          {"limits_words",
           json_of(hand_limits(state, scene.arm().joints(), tool_freedom(scene.arm(), state.arm.position),
                               staleness, now_ns))},
          {"delay", delay_json(state, staleness, now_ns)},
          {"model",
           {{"min_m", vector_json(messages::vector_of(scene.min_m()))},
            {"max_m", vector_json(messages::vector_of(scene.max_m()))},
            {"voxel_error_m", number_or_null(state.workspace.voxel_error_m, state.workspace.version != 0)},
            {"version", state.workspace.version},
            {"undo", undo_json(state)}}},
          {"doubts", doubts_json(state)},
          {"findings", findings_json(state)},
          {"live", live_json(state)},
          {"review", review_json(facts)},
          {"recording",
           {{"running", state.recording.running},
            {"view", name_of(state.recording.view)},
            {"file", state.recording.file},
            {"problem", state.recording.problem}}}};
}

}  // namespace phantom::synthetic_viewer
