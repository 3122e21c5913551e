#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "components/synthetic_viewer/image.hpp"

namespace phantom::synthetic_viewer {

/// Writes a session's report folder: pictures and synthetic_viewer.json. Does nothing without a folder.
/// Pictures are encoded and written on a separate thread; use the class on one thread.
class Report {
 public:
  /// Creates the folder. Throws core::MissingError if that fails.
  Report(std::filesystem::path folder, int most_hit_pictures);

  ~Report();
  Report(Report&&) noexcept;

  bool wanted() const { return !folder_.empty(); }
  bool wants_hit_pictures() const { return wanted() && views_.size() < most_hit_pictures_; }

  /// Saves a picture of the main view as <name>.png.
  void save(const std::string& name, Image image);
  /// Saves the first picture of an alert as hit_<running number>_<node>.png. The running number is the
  /// report's own, because alerts count from 1 again when the phantom restarts.
  void save_hit(std::uint32_t alert, const std::string& node, double t_s, std::int64_t utc_ns, Image image);

  struct Summary {
    std::uint64_t frames = 0;
    double seconds = 0.0;
    double frame_p50_s = 0.0, frame_max_s = 0.0;  ///< duration of a round of pictures
    std::uint64_t alerts = 0;
    double alert_to_picture_max_s = 0.0;
    std::string page, graphics;
  };
  /// Waits until all pictures are written, then writes synthetic_viewer.json.
  void finish(const Summary& summary);

 private:
  struct View {
    double t_s;
    std::int64_t utc_ns;
    std::string node, png;
    std::uint32_t alert;
  };
  class Writer;

  std::filesystem::path folder_;
  std::unique_ptr<Writer> writer_;
  std::size_t most_hit_pictures_;
  std::vector<View> views_;
  std::vector<std::string> pictures_;
};

}  // namespace phantom::synthetic_viewer
