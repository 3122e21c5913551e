// How long two participants of the product need until they exchange samples, by UDP on loopback. Nothing here
// is judged: the times compare releases of Fast DDS (docs/fast_dds.md).
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "tests/bench/repetitions.hpp"
#include "tests/bench/security_site.hpp"

namespace phantom::bench {
namespace {

using benchmark::State;

constexpr int kDomain = 78;

double now_s() { return core::seconds(core::monotonic_ns()); }

void wait_for(const std::function<bool()>& condition) {
  for (const double from_s = now_s(); !condition(); usleep(200)) {
    if (now_s() - from_s > 60) throw std::runtime_error("the two participants do not find each other");
  }
}

/// A domain of this benchmark's own, secured or not.
class Domain {
 public:
  explicit Domain(bool secured) {
    if (!secured) return;
    site_.emplace("serving | workspace_version |\njoining | | workspace_version\n", kDomain);
    if (!site_->made()) throw std::runtime_error("deploy/security/make failed");
  }
  core::NetworkOptions network() const {
    core::NetworkOptions options{.domain = kDomain,
                                 .qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml",
                                 .interfaces = {"127.0.0.1"}};
    if (site_) options.security = site_->documents();
    return options;
  }

 private:
  std::optional<SecuritySite> site_;
};

msg::WorkspaceVersion sample() { return {}; }

/// From making the second participant until both have matched, or its reader has the sample that was kept.
void join(State& state, bool secured, bool to_sample) {
  try {
    const Domain domain(secured);
    for (auto _ : state) {
      dds::Participant serving("serving", domain.network());
      dds::Writer<msg::WorkspaceVersion> writer(serving, dds::kWorkspaceVersion);
      writer.write(sample());
      usleep(300'000);  // its first announcements are over
      std::atomic<bool> heard = false;
      const double from_s = now_s();
      dds::Participant joining("joining", domain.network());
      dds::Reader<msg::WorkspaceVersion> reader(joining, dds::kWorkspaceVersion,
                                                [&](const auto&, const dds::SampleInfo&) { heard = true; });
      wait_for([&] { return to_sample ? heard.load() : writer.matched() == 1 && reader.matched() == 1; });
      state.SetIterationTime(now_s() - from_s);
    }
  } catch (const std::exception& problem) {
    state.SkipWithError(problem.what());
  }
}

/// From making a reader in a participant that is known until it has the sample that was kept: the first
/// acknowledgement asks for it.
void first_acknowledgement(State& state, bool secured) {
  try {
    const Domain domain(secured);
    dds::Participant serving("serving", domain.network());
    dds::Writer<msg::WorkspaceVersion> writer(serving, dds::kWorkspaceVersion);
    writer.write(sample());
    dds::Participant joining("joining", domain.network());
    const auto until_heard = [&] {
      std::atomic<bool> heard = false;
      const double from_s = now_s();
      const dds::Reader<msg::WorkspaceVersion> reader(
          joining, dds::kWorkspaceVersion, [&](const auto&, const dds::SampleInfo&) { heard = true; });
      wait_for([&] { return heard.load(); });
      return now_s() - from_s;
    };
    until_heard();
    for (auto _ : state) {
      wait_for([&] { return writer.matched() == 0; });
      state.SetIterationTime(until_heard());
    }
  } catch (const std::exception& problem) {
    state.SkipWithError(problem.what());
  }
}

[[maybe_unused]] const bool registered = [] {
  for (const bool secured : {false, true}) {
    const std::string kind = secured ? "/secured" : "/plain";
    for (auto* benchmark :
         {benchmark::RegisterBenchmark(("join/matched" + kind).c_str(), join, secured, false),
          benchmark::RegisterBenchmark(("join/first_sample" + kind).c_str(), join, secured, true),
          benchmark::RegisterBenchmark(("first_acknowledgement" + kind).c_str(), first_acknowledgement,
                                       secured)})
      benchmark->UseManualTime()->Iterations(1)->Repetitions(repetitions(11))->Unit(benchmark::kMillisecond);
  }
  return true;
}();

}  // namespace
}  // namespace phantom::bench
