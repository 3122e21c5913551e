#include "components/synthetic_viewer/config.hpp"

#include "common/core/units.hpp"
#include "common/runtime/config_reader.hpp"

namespace phantom::synthetic_viewer {
namespace {

using runtime::ConfigReader;

GraphicsPlatform read_graphics(const ConfigReader& file) {
  const std::string name = file.choice("graphics", "auto", {"auto", "device", "surfaceless", "display"});
  if (name == "device") return GraphicsPlatform::kDevice;
  if (name == "surfaceless") return GraphicsPlatform::kSurfaceless;
  if (name == "display") return GraphicsPlatform::kDisplay;
  return GraphicsPlatform::kAuto;
}

PictureFormat read_format(const ConfigReader& view, PictureFormat format, bool shadows) {
  format.width_px = view.integer("width_px", format.width_px, {160, 3840, "px"});
  format.height_px = view.integer("height_px", format.height_px, {120, 2160, "px"});
  format.samples = view.integer("samples", format.samples, {1, 8, "per pixel"});
  format.shadows = shadows;
  return format;
}

double read_field_of_view(const ConfigReader& view, double fallback_deg) {
  return core::kRadPerDegree * view.number("field_of_view_deg", fallback_deg, {10, 120, "deg"});
}

MainViewConfig read_main_view(const ConfigReader& view, bool shadows) {
  MainViewConfig config;
  config.format = read_format(view, config.format, shadows);
  config.azimuth_rad = core::kRadPerDegree * view.number("azimuth_deg", -50.0, {-360, 360, "deg"});
  config.elevation_rad = core::kRadPerDegree * view.number("elevation_deg", 26.0, {-89, 89, "deg"});
  config.field_of_view_rad = read_field_of_view(view, 34.0);
  config.margin = view.number("margin", 0.8, {0.3, 3, ""});
  return config;
}

HitZoneViewConfig read_hit_view(const ConfigReader& view, bool shadows) {
  HitZoneViewConfig config;
  config.format = read_format(view, config.format, shadows);
  config.field_of_view_rad = read_field_of_view(view, 42.0);
  ViewChoiceConfig& choice = config.rule.choice;
  choice.distance_m = view.number("distance_m", choice.distance_m, {0.05, 10, "m"});
  choice.margin = view.number("margin", choice.margin, {0, 1, ""});
  choice.dwell_s = view.number("dwell_s", choice.dwell_s, {0, 60, "s"});
  choice.least_stay_s = view.number("least_stay_s", choice.least_stay_s, {0, 60, "s"});
  config.rule.least_show_s = view.number("least_show_s", config.rule.least_show_s, {0, 60, "s"});
  config.rule.hold_after_clear_s =
      view.number("hold_after_clear_s", config.rule.hold_after_clear_s, {0, 600, "s"});
  return config;
}

ToolViewConfig read_tool_view(const ConfigReader& view, bool shadows) {
  ToolViewConfig config;
  config.enabled = view.flag("enabled", config.enabled);
  config.format = read_format(view, config.format, shadows);
  config.field_of_view_rad = read_field_of_view(view, 60.0);
  config.eye_m = view.vector3("eye_m", {0.16, 0.0, 0.06});
  config.look_at_m = view.vector3("look_at_m", {0.0, 0.0, -0.12});
  if (!((config.eye_m - config.look_at_m).norm() > 1e-3)) {
    throw view.error("look_at_m", "must not be the place of eye_m itself");
  }
  return config;
}

PageConfig read_page(const ConfigReader& page) {
  PageConfig config;
  config.enabled = page.flag("enabled", config.enabled);
  config.address = page.text("address", config.address);
  config.port = page.integer("port", config.port, {0, 65535, ""});
  config.stream_port = page.integer("stream_port", config.stream_port, {0, 65535, ""});
  if (config.stream_port != 0 && config.stream_port == config.port)
    throw page.error("stream_port", "must not be page.port itself: pictures must not hold up a stop");
  config.allow_commands = page.flag("allow_commands", config.allow_commands);
  config.max_streams = page.integer("max_streams", config.max_streams, {2, 200, ""});
  return config;
}

RecordingConfig read_recording(const ConfigReader& section) {
  RecordingConfig config;
  config.folder = section.text("folder", "");
  config.format =
      section.choice("format", "mp4", {"mp4", "avi"}) == "avi" ? VideoFormat::kAvi : VideoFormat::kMp4;
  config.rate_hz = section.number("rate_hz", config.rate_hz, {1, 60, "Hz"});
  config.at_start = view_from_name(section.choice("at_start", "none", {"none", "main", "hit", "tool"}));
  return config;
}

}  // namespace

ViewerConfig load_config(const std::filesystem::path& path) {
  const ConfigReader file = ConfigReader::from_file(path);
  ViewerConfig config;
  config.graphics = read_graphics(file);
  config.frame_rate_hz = file.number("frame_rate_hz", config.frame_rate_hz, {0.1, 120, "Hz"});
  config.niceness = file.integer("niceness", config.niceness, {0, 19, ""});
  config.jpeg_quality = file.integer("jpeg_quality", config.jpeg_quality, {10, 100, "%"});
  config.arm = file.text("arm", "");
  const bool shadows = file.flag("shadows", true);
  config.main_view = read_main_view(file.optional_section("main_view"), shadows);
  config.hit_view = read_hit_view(file.optional_section("hit_view"), shadows);
  config.tool_view = read_tool_view(file.optional_section("tool_view"), shadows);
  const ConfigReader stale = file.optional_section("staleness");
  config.staleness.slave_s = stale.number("slave_s", config.staleness.slave_s, {0.01, 60, "s"});
  config.staleness.percept_s = stale.number("percept_s", config.staleness.percept_s, {0.01, 60, "s"});
  config.staleness.component_s = stale.number("component_s", config.staleness.component_s, {0.5, 60, "s"});
  config.page = read_page(file.optional_section("page"));
  config.window.wanted = file.flag("window", false);
  config.recording = read_recording(file.optional_section("recording"));
  const ConfigReader report = file.optional_section("report");
  config.report_samples = report.integer("samples", config.report_samples, {1, 8, "per pixel"});
  config.report_pictures = report.integer("hit_pictures", config.report_pictures, {0, 100000, ""});
  file.finish();
  return config;
}

}  // namespace phantom::synthetic_viewer
