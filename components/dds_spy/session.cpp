#include "components/dds_spy/session.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "common/core/clock.hpp"
#include "common/diagnostics/text.hpp"
#include "common/observation/type_catalogue.hpp"
#include "common/runtime/process/process.hpp"
#include "components/dds_spy/echo.hpp"
#include "components/dds_spy/line_queue.hpp"
#include "components/dds_spy/live_view.hpp"
#include "components/dds_spy/reports.hpp"
#include "components/dds_spy/terminal.hpp"

namespace phantom::dds_spy {
namespace {

using diagnostics::to_line;

constexpr double kLook_s = 0.02;  // between two checks for new writers and missed deadlines
constexpr std::size_t kMaxLines = 20'000, kMaxLineOctets = 16 << 20;

// Returns whether the patterns name a type: by its full name, its name without modules, or its topic's name.
bool is_requested(const std::string& topic, const std::string& type,
                  const std::vector<std::string>& patterns) {
  const auto module_end = type.rfind("::");
  const std::string names[] = {topic, type,
                               module_end == std::string::npos ? type : type.substr(module_end + 2)};
  bool any_wanted = false, wanted = false;
  for (const std::string& pattern : patterns) {
    const bool takes_away = pattern.starts_with('!');
    const diagnostics::NameFilter like({takes_away ? pattern.substr(1) : pattern});
    const bool hit =
        std::any_of(std::begin(names), std::end(names), [&](const auto& name) { return like.keeps(name); });
    if (takes_away && hit) return false;
    any_wanted = any_wanted || !takes_away;
    wanted = wanted || (hit && !takes_away);
  }
  return wanted || !any_wanted;
}

int print_types(const Request& request, std::ostream& out) {
  bool any = false;
  for (const auto& [topic, contract] : contracts()) {
    if (!is_requested(topic, contract.type, request.topics)) continue;
    const auto type = observation::type_of(contract.type);
    const std::string text = diagnostics::idl_text(*type);
    if (request.json) {
      out << to_line({{"topic", topic}, {"type", contract.type}, {"idl", text}}) << '\n';
    } else {
      out << "// topic " << topic << '\n' << text << '\n';
    }
    any = true;
  }
  if (!any)
    throw core::ConfigError("types: no type of the project is like that; dds_spy types prints them all");
  return runtime::kExitDone;
}

class Session {
 public:
  Session(const Request& request, const Config& config, const core::NetworkOptions& network,
          std::ostream& out)
      : request_(request),
        config_(config),
        domain_(network.domain),
        out_(out),
        event_kinds_(request.kinds),
        topics_(request.topics),
        echo_(request.json, request.every_s, request.count),
        view_(config.most_events, config.quiet_s, [this](const Event& event) { report(event); }),
        adapter_(network, reading_of(request), view_, sample_handler()) {}

  int run() {
    switch (request_.command) {
      case Command::kTopology:
        return report(&topology_json, &topology_text, config_.discovery_s);
      case Command::kQos:
        return report(&qos_json, &qos_text, config_.discovery_s);
      case Command::kRates:
        return measure(&rates_json, &rates_text);
      case Command::kLatency:
        return measure(&latency_json, &latency_text);
      case Command::kEcho:
        return echo();
      case Command::kEvents:
        return events();
      default:
        return on_screen_ ? live() : live_as_text();
    }
  }

 private:
  using JsonReport = nlohmann::ordered_json (*)(const ReportInput&);
  using TextReport = std::string (*)(const ReportInput&);

  DdsAdapter::OnSample sample_handler() {
    if (request_.command != Command::kEcho) return {};
    return [this](const ReceivedSample& sample) {
      if (auto text = echo_.take(sample, view_.graph())) lines_.put(std::move(*text));
    };
  }

  void report(const Event& event) {
    const bool requested =
        request_.command == Command::kEvents || (request_.command == Command::kLive && !on_screen_);
    if (!requested || !event_kinds_.keeps(name_of(event.kind))) return;
    if (!event.topic.empty() && !topics_.keeps(event.topic)) return;
    lines_.put(request_.json ? to_line(event_json(event)) + "\n" : event_line(event) + "\n");
  }

  /// Runs one round of the periodic work. Returns false when the session is to end.
  bool look() {
    for (const auto& problem : adapter_.follow_writers()) spdlog::warn("{}", problem);
    {
      const auto lock = adapter_.lock();
      view_.look(core::monotonic_ns(), core::utc_ns());
      if (view_.samples_left_out() > 0 && !std::exchange(told_left_out_, true))
        spdlog::warn("there are more than {} writers; further ones are not measured",
                     SystemView::kMaxWriters);
    }
    return print_lines() && elapsed_s() < limit_s_ && runtime::sleep_unless_stopped(kLook_s);
  }

  /// Prints waiting lines. Returns false if the output has no reader any longer.
  bool print_lines() {
    const runtime::EndsAtOnce maybe_unread;  // a full pipe must not keep the process from ending
    for (const auto& text : lines_.take()) out_ << text;
    out_.flush();
    return static_cast<bool>(out_);
  }

  void set_limit(double fallback_s) {
    const double given_s = request_.seconds.value_or(fallback_s);
    limit_s_ = given_s == 0.0 ? std::numeric_limits<double>::infinity() : given_s;
  }

  double elapsed_s() const { return core::seconds(core::monotonic_ns() - start_ns_); }

  template <class Report>
  auto made(Report of, const diagnostics::NameFilter& topics) {
    const auto lock = adapter_.lock();
    return of(ReportInput{view_, contracts(), topics, domain_, elapsed_s()});
  }

  void print(JsonReport json, TextReport text) {
    if (request_.json) {
      out_ << to_line(made(json, topics_)) << std::endl;
    } else {
      out_ << made(text, topics_) << std::flush;
    }
  }

  int missing(const std::string& what) {
    spdlog::error("{} in domain {} within {:.1f} s; is the system running, and is this its deployment?", what,
                  domain_, elapsed_s());
    return runtime::kExitMissing;
  }

  // Distinguishes a mistyped topic name from a topic without samples.
  int no_samples() {
    std::set<std::string> known;
    {
      const auto lock = adapter_.lock();
      for (const auto& [guid, endpoint] : view_.graph().endpoints()) known.insert(endpoint.topic);
    }
    const bool there =
        std::any_of(known.begin(), known.end(), [&](const auto& name) { return topics_.keeps(name); });
    if (known.empty() || there) return missing("no sample of these topics");
    spdlog::error("no topic in domain {} has such a name; there are: {}", domain_, fmt::join(known, ", "));
    return runtime::kExitMissing;
  }

  int report(JsonReport json, TextReport text, double fallback_s) {
    set_limit(fallback_s);
    while (look()) {
    }
    print(json, text);
    const auto lock = adapter_.lock();
    return view_.graph().participants().empty() ? missing("no participant")
                                                : static_cast<int>(runtime::kExitDone);
  }

  std::uint64_t samples() {
    const auto lock = adapter_.lock();
    std::uint64_t sum = 0;
    for (const auto& [guid, writer] : view_.writers()) sum += writer.stream.figures().samples;
    return sum;
  }

  int measure(JsonReport json, TextReport text) {
    set_limit(config_.measure_s);
    double next_s = request_.interval_s;
    while (look()) {
      if (request_.interval_s <= 0.0 || elapsed_s() < next_s) continue;
      print(json, text);
      next_s += request_.interval_s;
    }
    print(json, text);
    return samples() == 0 ? no_samples() : static_cast<int>(runtime::kExitDone);
  }

  int echo() {
    set_limit(0.0);
    const auto complete = [this] {
      const auto lock = adapter_.lock();
      return echo_.complete();
    };
    while (!complete() && look()) {
    }
    print_lines();
    if (lines_.dropped() > 0)
      spdlog::warn("{} samples were not shown: the output takes them too slowly (--every shows fewer)",
                   lines_.dropped());
    return echo_.shown() == 0 ? no_samples() : static_cast<int>(runtime::kExitDone);
  }

  int events() {
    set_limit(0.0);
    while (look()) {
    }
    {
      const auto lock = adapter_.lock();
      view_.events().flush();
    }
    print_lines();
    return runtime::kExitDone;
  }

  /// Runs without a terminal: prints events as they come, and the figures periodically.
  int live_as_text() {
    set_limit(0.0);
    double next_s = config_.refresh_s;
    while (look()) {
      if (elapsed_s() < next_s) continue;
      print(&all_streams_json, &all_streams_text);
      next_s += config_.refresh_s;
    }
    return runtime::kExitDone;
  }

  static nlohmann::ordered_json all_streams_json(const ReportInput& input) {
    return {{"rates", rates_json(input)}, {"latency", latency_json(input)}};
  }
  static std::string all_streams_text(const ReportInput& input) {
    return fmt::format("\n{}\n{}", rates_text(input), latency_text(input));
  }

  std::string body(const LiveView& live) {
    switch (live.page()) {
      case Page::kRates:
        return made(&rates_text, live.filter());
      case Page::kLatency:
        return made(&latency_text, live.filter());
      case Page::kTopology:
        return made(&topology_text, live.filter());
      case Page::kQos:
        return made(&qos_text, live.filter());
      case Page::kEvents:
        return newest_events(live.filter());
      default:
        return LiveView::help();
    }
  }

  std::string newest_events(const diagnostics::NameFilter& topics) {
    const auto lock = adapter_.lock();
    std::string text;
    const auto& newest = view_.events().newest();
    for (auto event = newest.rbegin(); event != newest.rend(); ++event) {
      if (event->topic.empty() ? topics.keeps_all() : topics.keeps(event->topic))
        text += event_line(*event) + "\n";
    }
    return text.empty() ? "nothing happened yet\n" : text;
  }

  int live() {
    set_limit(0.0);
    LiveView live;
    Terminal terminal;
    std::string text;
    double next_s = 0.0;
    while (!live.quit() && look()) {
      const auto keys = terminal.keys(0.0);
      for (const int key : keys) live.press(key);
      if (live.take_reset()) {
        const auto lock = adapter_.lock();
        view_.reset_counts();
      }
      const bool due = elapsed_s() >= next_s;
      if (!due && keys.empty()) continue;
      if (due) next_s = elapsed_s() + config_.refresh_s;
      if (!live.paused() || !keys.empty()) text = body(live);
      terminal.draw(live.screen("dds_spy, domain " + std::to_string(domain_), text, terminal.columns(),
                                terminal.rows()));
    }
    return runtime::kExitDone;
  }

  const Request& request_;
  const Config& config_;
  const int domain_;
  std::ostream& out_;
  const diagnostics::NameFilter event_kinds_, topics_;
  const bool on_screen_ = request_.command == Command::kLive && !request_.json && Terminal::available();
  const core::Nanoseconds start_ns_ = core::monotonic_ns();
  double limit_s_ = 0.0;
  bool told_left_out_ = false;
  LineQueue lines_{kMaxLines, kMaxLineOctets};
  Echo echo_;
  SystemView view_;
  DdsAdapter adapter_;  // last: its threads use the other members
};

}  // namespace

int run(const Request& request, const Config& config, const core::NetworkOptions& network,
        std::ostream& out) {
  if (request.command == Command::kTypes) return print_types(request, out);
  return Session(request, config, network, out).run();
}

}  // namespace phantom::dds_spy
