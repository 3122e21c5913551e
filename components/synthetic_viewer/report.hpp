#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "components/synthetic_viewer/image.hpp"

namespace phantom::synthetic_viewer {

/// What a session leaves in its report folder: pictures and synthetic_viewer.json. Does nothing without a
/// folder. Pictures are encoded and written on a thread of its own; the rest is for one thread.
class Report {
 public:
  /// Makes the folder. Throws core::MissingError if that cannot be done.
  Report(std::filesystem::path folder, int most_hit_pictures);

  ~Report();
  Report(Report&&) noexcept;

  bool wanted() const { return !folder_.empty(); }
  bool wants_hit_pictures() const { return wanted() && views_.size() < most_hit_pictures_; }

  /// A picture of the main view as <name>.png.
  void save(const std::string& name, Image image);
  /// The first picture of an alert, as hit_<running number>_<node>.png: alerts count from 1 again
  /// when the phantom restarts.
  void save_hit(std::uint32_t alert, const std::string& node, double t_s, std::int64_t utc_ns, Image image);

  struct Summary {
    std::uint64_t frames = 0;
    double seconds = 0.0;
    double frame_p50_s = 0.0, frame_max_s = 0.0;  ///< time that a round of pictures took
    std::uint64_t alerts = 0;
    double alert_to_picture_max_s = 0.0;
    std::string page, graphics;
  };
  /// Once all pictures are written.
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
