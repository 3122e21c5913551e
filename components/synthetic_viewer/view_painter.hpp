#pragma once

#include <memory>
#include <optional>

#include "components/synthetic_viewer/compositor.hpp"
#include "components/synthetic_viewer/page_content.hpp"
#include "components/synthetic_viewer/renderer.hpp"

namespace phantom::synthetic_viewer {

/// Makes one view's pictures, and only those that differ from the last: what stands still is drawn, written
/// on and encoded once, however often it is asked for and by however many. One thread, that of the renderer.
class ViewPainter {
 public:
  /// Makes the newest picture, with its HUD. False, and all stays as it was, if `give_up` said yes on the
  /// way.
  bool draw(Renderer& renderer, const Compositor::Picture& picture, const PictureFormat& format,
            const GiveUp& give_up = {});
  /// The newest picture; null: none yet.
  const std::shared_ptr<const Image>& image() const { return image_; }
  /// The newest picture as JPEG.
  const std::shared_ptr<const std::string>& jpeg(int quality);
  /// Hands the newest picture to those who follow it; nothing if they have it.
  void publish(ViewOutput& output, int quality);
  /// Whether a draw since the last publish() made another picture.
  bool changed() const { return changed_; }

 private:
  std::optional<Compositor::Picture> last_;
  Image bare_;  // without HUD
  std::shared_ptr<const Image> image_, encoded_;
  std::shared_ptr<const std::string> jpeg_;  // of encoded_
  bool changed_ = false;
};

}  // namespace phantom::synthetic_viewer
