#include "components/phantom_sensing/service.hpp"

#include <spdlog/spdlog.h>

#include <array>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/core/errors.hpp"
#include "common/core/text.hpp"
#include "common/robot/sensing/skin_patches.hpp"
#include "common/runtime/process/process.hpp"
#include "components/phantom_sensing/alert_relay.hpp"
#include "components/phantom_sensing/contact_register.hpp"
#include "components/phantom_sensing/dds_adapter.hpp"
#include "components/phantom_sensing/model.hpp"
#include "components/phantom_sensing/tools/hit_log.hpp"
#include "components/phantom_sensing/tools/self_test.hpp"

namespace phantom::phantom_sensing {
namespace {

constexpr double kPoll_s = 0.05, kStatusPeriod_s = 0.5;

/// Figures and messages for component_status.
struct Situation {
  LoopFigures figures;
  std::uint64_t workspace_version = 0;
  double tick_rate_hz = 0.0;
  std::size_t allowed_contacts = 0;
  std::vector<std::string> carried;  ///< names of what the arm carries
  std::vector<std::string> apart;    ///< of objects that stand elsewhere in the arm's workspace than here
  std::uint64_t self_tests = 0;
  SelfTestResult self_test;
  std::string doubt;  ///< what the newest doubt of the model that holds says
};

struct ConditionReport {
  const char* text;
  core::ComponentState state;
};

/// What component_status says of each PerceptCondition, in its order.
constexpr std::array<ConditionReport, 10> kReports{{
    {"", core::ComponentState::kRunning},
    {"no wva_server is there: the workspace stays as it was", core::ComponentState::kRunning},
    {"a newer workspace was announced and is not whole yet", core::ComponentState::kDegraded},
    {"the workspace is stale, a newer one does not become whole: no percept",
     core::ComponentState::kDegraded},
    {"waiting for the workspace", core::ComponentState::kStarting},
    {"waiting for slave_state", core::ComponentState::kReady},
    {"slave_state is stale: no percept", core::ComponentState::kDegraded},
    {"no percept", core::ComponentState::kFault},
    {"", core::ComponentState::kDegraded},
    {"no depth camera sees the space around the arm's place now", core::ComponentState::kRunning},
}};
static_assert(static_cast<std::size_t>(PerceptCondition::kSpaceUnseen) + 1 == kReports.size());

std::string names_of(const std::bitset<kMaxShares>& shares, const PhantomModel& model) {
  std::string names;
  for (std::size_t i = 0; i < model.shares.size(); ++i)
    if (shares[i]) core::add_to_list(names, model.shares[i].name);
  return names;
}

/// Returns what silent arms mean for the percept; empty: none is silent.
std::string silence_of(const LoopFigures& figures, const std::vector<OtherArm>& others) {
  std::string names;
  for (std::size_t i = 0; i < others.size(); ++i)
    if (figures.others_silent[i]) core::add_to_list(names, others[i].name());
  if (names.empty()) return names;
  return "no slave_state comes of " + names +
         (is_valid(figures.condition) ? ": felt where it was last" : ": no percept");
}

std::string apart_sentence(const std::vector<std::string>& names) {
  return "; OBJECTS STAND ELSEWHERE in the arm's workspace than in this share's, move them in both: " +
         core::listed(names);
}

core::Health health_of(const Situation& now, const PhantomModel& model, const std::vector<OtherArm>& others) {
  const LoopFigures& figures = now.figures;
  core::Health health;
  const ConditionReport& report = kReports[static_cast<std::size_t>(figures.condition)];
  const bool waits = figures.condition == PerceptCondition::kWorkspaceUnattended && !figures.state_seen;
  health.state = waits ? core::ComponentState::kReady : report.state;
  health.message = report.text;
  const bool by_workspace =
      (figures.condition == PerceptCondition::kNoWorkspace && now.workspace_version != 0) ||
      figures.condition == PerceptCondition::kWorkspaceBehind ||
      figures.condition == PerceptCondition::kWorkspaceStale;
  if (const std::string silent = silence_of(figures, others); by_workspace && !silent.empty())
    health.message = silent;
  if (figures.condition == PerceptCondition::kSelfTestFailed) health.message += ", " + now.self_test.message;
  if (const std::string missing = names_of(figures.shares_resting, model); !missing.empty()) {
    if (health.state == core::ComponentState::kRunning) health.state = core::ComponentState::kDegraded;
    health.message +=
        (health.message.empty() ? "" : "; ") +
        ("the processes of shares of the skin do not answer in time, they are sensed here: " + missing);
  }
  if (model.own_share)
    health.message +=
        (health.message.empty() ? "" : "; ") + ("senses share " + model.shares[*model.own_share].name);
  if (figures.outside)
    health.message += ", not now: a link reaches out of this share's workspace; it is sensed in the arm's";
  if (!now.apart.empty()) {
    if (health.state == core::ComponentState::kRunning) health.state = core::ComponentState::kDegraded;
    health.message += apart_sentence(now.apart);
  }
  if (!now.doubt.empty())
    health.message += (health.message.empty() ? "" : "; ") + ("THE MODEL IS IN DOUBT: " + now.doubt);
  if (now.allowed_contacts > 0) {
    health.message += (health.message.empty() ? "" : "; ") + std::to_string(now.allowed_contacts) +
                      " contacts are allowed and not felt";
  }
  for (const std::string& name : now.carried)
    health.message += (health.message.empty() ? "carries " : ", carries ") + name;
  health.figures = {{"sensors", static_cast<double>(model.skin.size()), ""},
                    {"carried_objects", static_cast<double>(now.carried.size()), ""},
                    {"active_sensors", static_cast<double>(figures.active_sensors), ""},
                    {"muted_sensors", static_cast<double>(figures.muted_sensors), ""},
                    {"allowed_contacts", static_cast<double>(now.allowed_contacts), ""},
                    {"interest_points", static_cast<double>(model.interest_points.size()), ""},
                    {"workspace_version", static_cast<double>(now.workspace_version), ""},
                    {"self_tests", static_cast<double>(now.self_tests), ""},
                    {"self_test_passed", now.self_test.passed ? 1.0 : 0.0, ""},
                    {"other_arms_silent", static_cast<double>(figures.others_silent.count()), ""},
                    {"objects_apart", static_cast<double>(now.apart.size()), ""},
                    {"shares_missing", static_cast<double>(figures.shares_resting.count()), ""},
                    {"shares_sensed_here", static_cast<double>(figures.shares_sensed_here), ""},
                    {"ticks", static_cast<double>(figures.ticks), ""},
                    {"tick_rate", now.tick_rate_hz, "Hz"},
                    {"tick_p50", figures.tick_p50_us, "us"},
                    {"tick_p99", figures.tick_p99_us, "us"},
                    {"tick_max", figures.tick_max_us, "us"},
                    {"model_age", 1e3 * figures.model_age_s, "ms"}};
  return health;
}

void write_report(const std::filesystem::path& folder, const Situation& now, const PhantomModel& model,
                  double seconds, const nlohmann::ordered_json& hits, const nlohmann::ordered_json& doubts) {
  const LoopFigures& figures = now.figures;
  const nlohmann::ordered_json report = {{"component", "phantom_sensing"},
                                         {"seconds", seconds},
                                         {"sensors", model.skin.size()},
                                         {"workspace_version", now.workspace_version},
                                         {"tick",
                                          {{"n", figures.ticks},
                                           {"p50_us", figures.tick_p50_us},
                                           {"p99_us", figures.tick_p99_us},
                                           {"max_us", figures.tick_max_us}}},
                                         {"invalid_turns", figures.invalid_turns},
                                         {"self_tests", now.self_tests},
                                         {"self_test", now.self_test.message},
                                         {"hits", hits},
                                         {"doubts", doubts}};
  std::filesystem::create_directories(folder);
  const std::string share = model.own_share ? "_" + model.shares[*model.own_share].name : "";
  const std::filesystem::path path = folder / ("phantom_sensing" + share + ".json");
  std::ofstream file(path);
  file << report.dump(2) << '\n';
  if (!file.flush()) throw std::runtime_error(path.string() + ": cannot be written");
}

/// The work of the main thread: commands, self-tests, permits, status. Its results reach the sensing loop
/// without a lock.
class Service {
 public:
  Service(const runtime::CellConfig& cell, const Config& config, const PhantomModel& model,
          const std::vector<OtherArm>& others, DdsAdapter& adapter, WorkspaceSubscriber& workspace,
          SensingLoop& loop)
      : cell_(cell),
        config_(config),
        model_(model),
        others_(others),
        adapter_(adapter),
        workspace_(workspace),
        loop_(loop),
        contacts_(model.arm),
        patches_(model.arm, model.skin, model.skin_options.voxel_size_m.reference_m()) {
    know_objects();
    for (const auto& contact : cell.arm(config.arm).allowed_contact) {
      const Answer answer = contacts_.handle({.request = messages::SensingRequest::kAllowContact,
                                              .object = contact.object,
                                              .link = contact.link},
                                             core::monotonic_ns());
      if (!answer.done) throw core::ConfigError(cell.file.string() + ": allowed_contact: " + answer.message);
      spdlog::info("{}", answer.message);
    }
    loop_.permit(contacts_.permits());
    loop_.expect_of_shares(contacts_.permits().at(core::monotonic_ns()));
  }

  std::string object_name(std::uint16_t id) const { return contacts_.object_name(id); }

  /// Call it once in kPoll_s.
  void poll() {
    know_objects();
    loop_.know_displaced(adapter_.displaced());
    loop_.workspace_watch().attended(adapter_.workspace_attended());
    if (!tested_ && workspace_.version() != 0) self_test();
    adapter_.handle_commands([this](const messages::SensingCommand& command) { return carry_out(command); });
    for (const std::string& ended : contacts_.end_old(core::monotonic_ns())) spdlog::info("{}", ended);
    loop_.permit(contacts_.permits());
  }

  /// Publishes what the whole skin feels, for display. Call it once in kPoll_s.
  void show_skin(core::Nanoseconds now_ns) {
    loop_.newest(slave_, gripper_);
    const LoopFigures figures = loop_.figures();
    const auto workspace = workspace_.share();
    messages::SkinPercept skin;
    skin.slave_echo = slave_.stamp;
    skin.valid = workspace && is_valid(figures.condition) && slave_.stamp.sequence_number != 0 &&
                 now_ns - slave_.received_ns <= core::from_seconds(config_.staleness_s);
    skin.workspace_version = workspace ? workspace->version : 0;
    skin.patch_m = patches_.edge_m();
    skin.patch_count = static_cast<std::uint32_t>(patches_.count());
    skin.greatest_mu_Pa_s_per_m = figures.greatest_neighbour_mu;
    if (skin.valid) {
      const percept::AllowedContact allowed = contacts_.permits().at(now_ns);
      const auto muted = [&allowed](std::size_t link, std::uint16_t object) {
        return allowed.mutes(link, object);
      };
      const bool known = is_current(gripper_, now_ns, core::from_seconds(config_.staleness_s));
      const double closed = known ? fingers_of(gripper_).closed : 0.0;
      for (const auto& patch : patches_.sense(slave_.position, *workspace, muted, closed)) {
        const Eigen::Vector3f middle_m = patch.middle_m.cast<float>();
        skin.felt.push_back(
            {static_cast<std::uint32_t>(patch.link), {middle_m.x(), middle_m.y(), middle_m.z()}, patch.mu});
      }
    }
    adapter_.publish_skin(skin);
  }

  Situation situation(core::Nanoseconds now_ns) {
    Situation now{loop_.figures(), workspace_.version(), 0.0, contacts_.permits().size(), {}, {},
                  self_tests_,     tested_as_,           {}};
    now.apart = adapter_.objects_apart(apart_, now_ns);
    if (now.apart != reported_apart_ && !now.apart.empty())
      spdlog::warn("{}", apart_sentence(now.apart).substr(2));
    reported_apart_ = now.apart;
    for (const std::uint16_t id : workspace_.carried()) now.carried.push_back(object_name(id));
    if (now_ns > before_ns_ && before_ns_ != 0)
      now.tick_rate_hz =
          static_cast<double>(now.figures.ticks - ticks_before_) / core::seconds(now_ns - before_ns_);
    before_ns_ = now_ns;
    ticks_before_ = now.figures.ticks;
    return now;
  }

 private:
  /// Takes the names of the objects from the cell file until wva_server has announced some; from then on,
  /// those.
  void know_objects() {
    std::map<std::uint16_t, std::string> names;
    for (const auto& [id, object] : adapter_.objects()) names[id] = object.name;
    if (names.empty()) {
      for (std::size_t i = 0; i < cell_.objects.size(); ++i)
        names[static_cast<std::uint16_t>(i + 1)] = cell_.objects[i].name;
    }
    for (const OtherArm& other : others_) names[other.id()] = other.name();
    contacts_.know_objects(std::move(names));
  }

  Answer carry_out(const messages::SensingCommand& command) {
    if (command.request == messages::SensingRequest::kSelfTest) return self_test();
    if (command.request == messages::SensingRequest::kListContacts)
      return contacts_.list(core::monotonic_ns());
    const Answer answer = contacts_.handle(command, core::monotonic_ns());
    loop_.permit(contacts_.permits());
    return answer;
  }

  Answer self_test() {
    tested_ = true;
    ++self_tests_;
    tested_as_ = test_step(config_.percept);
    const auto workspace = workspace_.share();
    if (tested_as_.passed && workspace) tested_as_ = test_workspace(*workspace, cell_, config_.percept);
    loop_.self_tested(tested_as_.passed);
    spdlog::log(tested_as_.passed ? spdlog::level::info : spdlog::level::err, "{}", tested_as_.message);
    return {tested_as_.passed, tested_as_.message};
  }

  const runtime::CellConfig& cell_;
  const Config& config_;
  const PhantomModel& model_;
  const std::vector<OtherArm>& others_;
  DdsAdapter& adapter_;
  WorkspaceSubscriber& workspace_;
  SensingLoop& loop_;
  ContactRegister contacts_;
  robot::SkinPatches patches_;
  SecondaryWorkspace apart_;
  std::vector<std::string> reported_apart_;
  SlaveSample slave_;  // the newest state
  GripperSample gripper_;
  bool tested_ = false;
  std::uint64_t self_tests_ = 0;
  SelfTestResult tested_as_;
  core::Nanoseconds before_ns_ = 0;
  std::uint64_t ticks_before_ = 0;
};

/// Runs the sensing loop on its own thread, with the readers that feed it. Its destructor ends both, also
/// when the main thread throws, because they use objects that are destroyed next.
class Sensing {
 public:
  Sensing(DdsAdapter& adapter, SensingLoop& loop) : adapter_(adapter), loop_(loop) {}
  ~Sensing() { end(); }

  void begin(WorkspaceSubscriber& workspace) {
    thread_ = std::jthread([this] { loop_.run(); });
    adapter_.start_reading(loop_, workspace);
  }
  void end() {
    adapter_.stop_reading();
    loop_.stop();
    if (thread_.joinable()) thread_.join();
  }

 private:
  DdsAdapter& adapter_;
  SensingLoop& loop_;
  std::jthread thread_;
};

}  // namespace

int run_service(const runtime::ProcessOptions& options, const runtime::Deployment& deployment,
                const runtime::CellConfig& cell, const Config& config, const PhantomModel& model,
                const std::vector<OtherArm>& others) {
  if (const SelfTestResult tested = test_step(config.percept); !tested.passed)
    throw std::runtime_error(tested.message);
  const auto shares =
      share_partitions(deployment.network.partition, config, model, allowed_contact(cell, config, model));
  core::NetworkOptions network = core::in_haptic_path(deployment.network, config.servo_priority);
  network.model_label = robot::label_of(model.identity);
  DdsAdapter adapter(network, model, shares, others);
  CarriedParts parts(model, config.percept, config.servo_priority);
  WorkspaceSubscriber workspace(adapter.workspace_callbacks(), config.workspace_max_bytes, &parts);
  HitLog hits(adapter, model);
  AlertRelay relay(hits, config.servo_priority);
  // Made here because its workers inherit their scheduling from the thread that creates them.
  std::unique_ptr<SensingLoop> sensing_loop;
  core::run_in_place(core::ThreadRole::kSensing, config.servo_priority, [&] {
    sensing_loop = std::make_unique<SensingLoop>(model, config, workspace, relay, others);
  });
  SensingLoop& loop = *sensing_loop;
  Service service(cell, config, model, others, adapter, workspace, loop);
  const auto object_name = [&service](std::uint16_t id) { return service.object_name(id); };
  spdlog::info("{} sensors and {} interest points on {} joints; waiting for workspace and slave_state",
               model.skin.size(), model.interest_points.size(), model.arm.joint_count());
  const core::Nanoseconds start_ns = core::monotonic_ns();
  Sensing sensing(adapter, loop);
  sensing.begin(workspace);
  if (const std::string refused =
          core::apply_thread_config(core::ThreadRole::kControl, config.servo_priority);
      !refused.empty())
    spdlog::warn("{}", refused);

  core::Nanoseconds next_status_ns = start_ns;
  PerceptCondition logged = PerceptCondition::kNoWorkspace;
  do {
    service.poll();
    hits.log_new(object_name);
    const core::Nanoseconds now_ns = core::monotonic_ns();
    service.show_skin(now_ns);
    if (now_ns < next_status_ns) continue;
    next_status_ns = now_ns + core::from_seconds(kStatusPeriod_s);
    Situation now = service.situation(now_ns);
    now.doubt = hits.doubt_in_force(object_name);
    core::Health health = health_of(now, model, others);
    health.loops = {loop.progress().statistics(), relay.progress().statistics(),
                    workspace.progress().statistics()};
    // That a place is unseen comes and goes as the arm moves: the page shows it, the log would fill.
    const bool unseen = now.figures.condition == PerceptCondition::kSpaceUnseen;
    const PerceptCondition to_log = unseen ? PerceptCondition::kFresh : now.figures.condition;
    if (to_log != logged) spdlog::info("{}", unseen || health.message.empty() ? "sensing" : health.message);
    logged = to_log;
    adapter.publish_status(health);
  } while (runtime::sleep_unless_stopped(kPoll_s));

  sensing.end();
  relay.end();
  hits.log_new(object_name);
  const Situation last = service.situation(core::monotonic_ns());
  core::Health ended = health_of(last, model, others);
  ended.state = core::ComponentState::kStopped;
  ended.message.clear();
  adapter.publish_status(ended);
  if (!options.report_dir.empty())
    write_report(options.report_dir, last, model, core::seconds(core::monotonic_ns() - start_ns),
                 hits.json(object_name), hits.doubts_json(object_name));
  return runtime::kExitDone;
}

}  // namespace phantom::phantom_sensing
