#include "components/synthetic_viewer/config.hpp"

#include "common/runtime/configuration/fields.hpp"
#include "common/web/request_origin.hpp"
#include "common/web/tls_context.hpp"

namespace phantom::synthetic_viewer {
namespace {

using runtime::Fields;

void read_format(const Fields& view, PictureFormat& format) {
  view.number("width_px", format.width_px);
  view.number("height_px", format.height_px);
  view.number("samples", format.samples);
}

void read_main_view(const Fields& view, MainViewConfig& config) {
  read_format(view, config.format);
  view.number("azimuth_deg", config.azimuth_rad, core::kRadPerDegree);
  view.number("elevation_deg", config.elevation_rad, core::kRadPerDegree);
  view.number("field_of_view_deg", config.field_of_view_rad, core::kRadPerDegree);
  view.number("margin", config.margin);
}

void read_hit_view(const Fields& view, HitZoneViewConfig& config) {
  read_format(view, config.format);
  ViewChoiceConfig& choice = config.rule.choice;
  view.number("distance_m", choice.distance_m);
  view.number("field_of_view_deg", config.field_of_view_rad, core::kRadPerDegree);
  view.number("margin", choice.margin);
  view.number("dwell_s", choice.dwell_s);
  view.number("least_stay_s", choice.least_stay_s);
  view.number("least_show_s", config.rule.least_show_s);
  view.number("hold_after_clear_s", config.rule.hold_after_clear_s);
}

void read_tool_view(const Fields& view, ToolViewConfig& config) {
  view.flag("enabled", config.enabled);
  read_format(view, config.format);
  view.number("field_of_view_deg", config.field_of_view_rad, core::kRadPerDegree);
  view.vector3("eye_m", config.eye_m);
  view.vector3("look_at_m", config.look_at_m);
  view.check((config.eye_m - config.look_at_m).norm() > 1e-3, "look_at_m",
             "must not be the place of eye_m itself");
}

void read_camera_view(const Fields& view, CameraViewConfig& config) {
  read_format(view, config.format);
  view.number("silent_s", config.staleness.silent_s);
  view.number("stuck_s", config.staleness.stuck_s);
  view.choice("inset", config.inset, {{"none", std::nullopt}, {"hit", View::kHit}, {"main", View::kMain}});
  if (view.text("camera").empty()) return;
  config.camera = load_video_camera(view.existing_file("camera"));
  view.check(config.camera->calibrated(), "camera",
             "has no lens or no pose: calibrate it (synthetic_viewer calibrate --help)");
}

void read_page(const Fields& page, const std::filesystem::path& page_secrets, PageConfig& config) {
  page.flag("enabled", config.enabled);
  page.text("address", config.address);
  page.number("port", config.port);
  page.number("stream_port", config.stream_port);
  page.check(config.stream_port == 0 || config.stream_port != config.port, "stream_port",
             "must not be page.port itself: pictures must not hold up a stop");
  page.texts("host_names", config.host_names);
  for (const std::string& name : config.host_names) {
    const auto parsed = web::parse_authority(name);
    page.check(web::parse_address(name) || (parsed && parsed->port.empty()), "host_names",
               "'" + name + "' is not a host name or an address without port, such as viewer.example");
  }
  const bool named = !page.text("secrets").empty();
  if (named || !page_secrets.empty())
    config.secrets = runtime::load_role_secrets(named ? page.path("secrets") : page_secrets);
  const auto address = web::parse_address(config.address);
  page.check(config.secrets || config.address == "localhost" || (address && address->is_loopback()),
             "address", "is not of loopback: there, page.secrets must name who may watch and command");
  const bool certificate = !page.text("certificate").empty(), key = !page.text("key").empty();
  page.check(certificate || !key, "certificate",
             "is missing; a key is for the certificate that it belongs to");
  page.check(key || !certificate, "key", "is missing; a certificate needs the file with its private key");
  if (certificate) config.tls = std::make_shared<web::TlsContext>(page.path("certificate"), page.path("key"));
  page.flag("allow_commands", config.allow_commands);
  page.flag("headset_hand", config.headset_hand);
  page.check(!config.headset_hand || config.allow_commands, "headset_hand",
             "leads the arm: page.allow_commands must be true");
  page.number("hand_silent_s", config.hand_silent_s);
  page.number("scene_Hz", config.scene_Hz);
  page.number("max_streams", config.max_streams);
  page.number("max_connections", config.max_connections);
  page.number("max_connections_per_address", config.max_connections_per_address);
}

}  // namespace

ViewerConfig load_config(const std::filesystem::path& path, const std::filesystem::path& page_secrets) {
  const runtime::Fields file(path, {kParameters});
  ViewerConfig config;
  using enum GraphicsPlatform;
  file.choice("graphics", config.graphics,
              {{"auto", kAuto}, {"device", kDevice}, {"surfaceless", kSurfaceless}, {"display", kDisplay}});
  file.choice("language", config.language, {{"en", Language::kEnglish}, {"de", Language::kGerman}});
  file.number("frame_rate_hz", config.frame_rate_hz);
  file.number("niceness", config.niceness);
  bool& shadows = config.main_view.format.shadows;
  file.flag("shadows", shadows);
  config.hit_view.format.shadows = config.tool_view.format.shadows = shadows;
  file.number("jpeg_quality", config.jpeg_quality);
  file.number("pictures_Hz", config.pictures_Hz);
  file.text("arm", config.arm);
  config.other_arms = runtime::read_other_arms(file);
  read_main_view(file.section("main_view"), config.main_view);
  read_hit_view(file.section("hit_view"), config.hit_view);
  read_tool_view(file.section("tool_view"), config.tool_view);
  read_camera_view(file.section("camera_view"), config.camera_view);
  const Fields arrow = file.section("pgv_arrow");
  arrow.choice("length", config.pgv_arrow.length,
               {{"inverse_strength", PgvLength::kInverseStrength},
                {"strength", PgvLength::kStrength},
                {"gap", PgvLength::kGap}});
  arrow.number("half_strength_Pa_s_per_m", config.pgv_arrow.half_strength_Pa_s_per_m);
  const auto stale = file.section("staleness");
  stale.number("slave_s", config.staleness.slave_s);
  stale.number("percept_s", config.staleness.percept_s);
  stale.number("component_s", config.staleness.component_s);
  read_page(file.section("page"), page_secrets, config.page);
  file.flag("window", config.window.wanted);
  const Fields recording = file.section("recording");
  recording.text("folder", config.recording.folder);
  recording.choice("format", config.recording.format,
                   {{"mp4", VideoFormat::kMp4}, {"avi", VideoFormat::kAvi}});
  recording.number("rate_hz", config.recording.rate_hz);
  recording.choice("at_start", config.recording.at_start,
                   {{"none", std::nullopt},
                    {"main", View::kMain},
                    {"hit", View::kHit},
                    {"tool", View::kTool},
                    {"camera", View::kCamera}});
  const auto report = file.section("report");
  report.number("samples", config.report_samples);
  report.number("hit_pictures", config.report_pictures);
  file.finish();
  return config;
}

}  // namespace phantom::synthetic_viewer
