#include "components/dds_recorder/config.hpp"

#include "common/runtime/configuration/fields.hpp"

namespace phantom::dds_recorder {
namespace {

constexpr double kKilo = 1e3, kMega = 1e6, kNanoseconds = 1e9;

}  // namespace

Config load_config(const std::filesystem::path& path) {
  const runtime::Fields file(path, {kParameters});
  Config config;
  RecorderSettings& recorder = config.recorder;
  file.text("folder", recorder.folder);
  file.text("name", recorder.name);
  file.check(!recorder.name.empty() && recorder.name.find('/') == std::string::npos, "name",
             "'" + recorder.name + "' cannot begin a file's name; allowed: text without /");
  file.texts("topics", config.topics);
  file.choice("mode", recorder.on_event, {{"continuous", false}, {"on_event", true}});
  const auto window = file.section("window");
  window.number("before_s", recorder.before_ns, kNanoseconds);
  window.number("memory_MB", recorder.window_bytes, kMega);
  window.number("after_s", recorder.after_ns, kNanoseconds);
  const auto triggers = file.section("triggers");
  triggers.flag("hit_alert", recorder.triggers.hit_alert);
  triggers.flag("degraded", recorder.triggers.degraded);
  triggers.flag("emergency_stop", recorder.triggers.emergency_stop);
  const auto split = file.section("split");
  split.number("size_MB", recorder.split_bytes, kMega);
  split.number("duration_s", recorder.split_ns, kNanoseconds);
  file.section("disk").number("margin_MB", recorder.margin_bytes, kMega);
  file.number("chunk_kB", recorder.chunk_bytes, kKilo);
  file.number("flush_interval_s", recorder.flush_ns, kNanoseconds);
  file.number("sync_interval_s", recorder.sync_ns, kNanoseconds);
  file.number("compression_level", recorder.zstd_level);
  file.number("queue_MB", config.queue_bytes, kMega);
  file.number("durable_memory_MB", recorder.durable_bytes, kMega);
  file.finish();
  return config;
}

}  // namespace phantom::dds_recorder
