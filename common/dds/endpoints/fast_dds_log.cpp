#include "common/dds/endpoints/fast_dds_log.hpp"

#include <spdlog/spdlog.h>

#include <cstdlib>
#include <fastdds/dds/log/Log.hpp>
#include <memory>
#include <mutex>

#include "common/dds/endpoints/dds_threads.hpp"

namespace phantom::dds {
namespace {

using eprosima::fastdds::dds::Log;
using eprosima::fastdds::dds::LogConsumer;

class Consumer final : public LogConsumer {
 public:
  void Consume(const Log::Entry& entry) override {
    const auto level = entry.kind == Log::Kind::Error     ? spdlog::level::err
                       : entry.kind == Log::Kind::Warning ? spdlog::level::warn
                                                          : spdlog::level::debug;
    spdlog::log(level, "Fast DDS, {}: {}", entry.context.category != nullptr ? entry.context.category : "",
                entry.message);
  }
};

}  // namespace

void take_over_fast_dds_log() {
  static std::once_flag once;
  std::call_once(once, [] {
    spdlog::default_logger();     // made before the handler below is registered, it ends after it
    with_dds_threads(false, [] {  // Fast DDS starts its log thread here
      Log::ClearConsumers();
      Log::RegisterConsumer(std::make_unique<Consumer>());
    });
    // That thread goes on while the process ends: it must not use a log that is gone.
    std::atexit([] { Log::ClearConsumers(); });
  });
}

}  // namespace phantom::dds
