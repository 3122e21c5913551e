#pragma once

#include <memory>
#include <optional>

#include "components/synthetic_viewer/compositor.hpp"
#include "components/synthetic_viewer/page_content.hpp"
#include "components/synthetic_viewer/renderer.hpp"

namespace phantom::synthetic_viewer {

/// Makes the pictures of one view, and only those that differ from the last: an unchanged picture is drawn,
/// annotated and encoded once, however often and by however many followers it is requested. One thread, that
/// of the renderer.
class ViewPainter {
 public:
  /// Makes the newest picture, with its HUD. Returns false and changes nothing if `give_up` returned true
  /// meanwhile.
  bool draw(Renderer& renderer, const Compositor::Picture& picture, const PictureFormat& format,
            const GiveUp& give_up = {});
  /// Returns the newest picture; null: none yet.
  const std::shared_ptr<const Image>& image() const { return image_; }
  /// Returns the newest picture as JPEG.
  const std::shared_ptr<const std::string>& jpeg(int quality);
  /// Publishes the newest picture to its followers; does nothing if they have it.
  void publish(ViewOutput& output, int quality);
  /// Returns whether draw() has made another picture since the last publish().
  bool changed() const { return changed_; }

 private:
  std::optional<Compositor::Picture> last_;
  Image bare_;  // without HUD
  std::shared_ptr<const Image> image_, encoded_;
  std::shared_ptr<const std::string> jpeg_;  // of encoded_
  bool changed_ = false;
};

}  // namespace phantom::synthetic_viewer
