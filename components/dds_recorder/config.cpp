#include "components/dds_recorder/config.hpp"

#include "common/runtime/config_reader.hpp"

namespace phantom::dds_recorder {
namespace {

constexpr double kMega = 1e6;

std::size_t megabytes(const runtime::ConfigReader& section, const char* key, double fallback_MB,
                      runtime::Range range) {
  return static_cast<std::size_t>(section.number(key, fallback_MB, range) * kMega);
}

core::Nanoseconds duration(const runtime::ConfigReader& section, const char* key, double fallback_s,
                           runtime::Range range) {
  return core::from_seconds(section.number(key, fallback_s, range));
}

void read_event(const runtime::ConfigReader& file, RecorderSettings& settings) {
  settings.on_event = file.choice("mode", "continuous", {"continuous", "on_event"}) == "on_event";
  const auto window = file.optional_section("window");
  settings.before_ns = duration(window, "before_s", 30, {0, 3600, "s"});
  settings.after_ns = duration(window, "after_s", 10, {0, 3600, "s"});
  settings.window_bytes = megabytes(window, "memory_MB", 256, {1, 1e6, "MB"});
  const auto triggers = file.optional_section("triggers");
  settings.triggers.hit_alert = triggers.flag("hit_alert", true);
  settings.triggers.degraded = triggers.flag("degraded", true);
  settings.triggers.emergency_stop = triggers.flag("emergency_stop", true);
}

}  // namespace

Config load_config(const std::filesystem::path& path) {
  const auto file = runtime::ConfigReader::from_file(path);
  Config config;
  RecorderSettings& settings = config.recorder;
  settings.folder = file.text("folder", "recordings");
  settings.name = file.text("name", "phantom");
  if (settings.name.empty() || settings.name.find('/') != std::string::npos)
    throw file.error("name", "'" + settings.name + "' cannot begin a file's name; allowed: text without /");
  if (file.has("topics")) config.topics = file.texts("topics");
  read_event(file, settings);
  const auto split = file.optional_section("split");
  settings.split_bytes = megabytes(split, "size_MB", 1024, {0.1, 1e7, "MB"});
  settings.split_ns = duration(split, "duration_s", 600, {1, 1e6, "s"});
  settings.margin_bytes = megabytes(file.optional_section("disk"), "margin_MB", 1024, {0, 1e9, "MB"});
  settings.chunk_bytes = static_cast<std::size_t>(file.number("chunk_kB", 1024, {4, 65536, "kB"}) * 1e3);
  settings.flush_ns = duration(file, "flush_interval_s", 1.0, {0.01, 60, "s"});
  settings.sync_ns = duration(file, "sync_interval_s", 5.0, {0.1, 3600, "s"});
  settings.zstd_level = file.integer("compression_level", 1, {0, 19, ""});
  config.queue_bytes = megabytes(file, "queue_MB", 64, {1, 1e5, "MB"});
  settings.durable_bytes = megabytes(file, "durable_memory_MB", 512, {1, 1e6, "MB"});
  file.finish();
  return config;
}

}  // namespace phantom::dds_recorder
