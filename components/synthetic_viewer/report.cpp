#include "components/synthetic_viewer/report.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/core/errors.hpp"
#include "components/synthetic_viewer/hud.hpp"

namespace phantom::synthetic_viewer {

Report::Report(std::filesystem::path folder, int most_hit_pictures)
    : folder_(std::move(folder)), most_hit_pictures_(static_cast<std::size_t>(most_hit_pictures)) {
  if (!wanted()) return;
  std::error_code problem;
  std::filesystem::create_directories(folder_, problem);
  if (problem) throw core::MissingError("report folder " + folder_.string() + ": " + problem.message());
}

void Report::write(const std::string& file, const std::string& content) const {
  std::ofstream out(folder_ / file, std::ios::binary);
  out.write(content.data(), static_cast<std::streamsize>(content.size()));
  if (!out) spdlog::error("cannot write {}", (folder_ / file).string());
}

void Report::save(const std::string& name, const Image& image) {
  if (!wanted()) return;
  write(name + ".png", encode_png(image));
  pictures_.push_back(name + ".png");
}

void Report::save_hit(std::uint32_t alert, const std::string& node, double t_s, std::int64_t utc_ns,
                      const Image& image) {
  if (!wants_hit_pictures()) return;
  char name[64];
  std::snprintf(name, sizeof name, "hit_%03zu_%s.png", views_.size() + 1, node.c_str());
  write(name, encode_png(image));
  views_.push_back({t_s, utc_ns, node, name, alert});
}

void Report::finish(const Summary& summary) const {
  if (!wanted()) return;
  nlohmann::json views = nlohmann::json::array();
  for (const View& view : views_) {
    views.push_back({{"t", view.t_s},
                     {"utc_ns", view.utc_ns},
                     {"node", view.node},
                     {"png", view.png},
                     {"alert", view.alert}});
  }
  const nlohmann::json json{
      {"frames", summary.frames},
      {"seconds", summary.seconds},
      {"fps", summary.seconds > 0 ? static_cast<double>(summary.frames) / summary.seconds : 0.0},
      {"frame_p50_ms", summary.frame_p50_s * 1e3},
      {"frame_max_ms", summary.frame_max_s * 1e3},
      {"alerts", summary.alerts},
      {"alert_to_picture_max_ms", summary.alert_to_picture_max_s * 1e3},
      {"views", views},
      {"pictures", pictures_},
      {"page", summary.page},
      {"graphics", summary.graphics}};
  write("synthetic_viewer.json", json.dump(2) + "\n");
}

}  // namespace phantom::synthetic_viewer
