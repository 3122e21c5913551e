#include "components/synthetic_viewer/view_painter.hpp"

#include <utility>

namespace phantom::synthetic_viewer {

bool ViewPainter::draw(Renderer& renderer, const Compositor::Picture& picture, const PictureFormat& format,
                       const GiveUp& give_up) {
  const bool other = !last_ || !same_picture(last_->frame, picture.frame);
  if (other) {
    auto drawn = renderer.render_unless(picture.frame, format, give_up);
    if (!drawn) return false;
    bare_ = std::move(*drawn);
  }
  if (other || last_->hud != picture.hud) {
    auto image = std::make_shared<Image>(bare_);
    draw_hud(*image, picture.hud);
    image_ = std::move(image);
    changed_ = true;
    // Compares with the frame last drawn, so that small steps cannot add up unseen.
    if (other) last_ = picture;
    last_->hud = picture.hud;
  }
  return true;
}

const std::shared_ptr<const std::string>& ViewPainter::jpeg(int quality) {
  if (encoded_ != image_ && image_) {
    jpeg_ = std::make_shared<const std::string>(encode_jpeg(*image_, quality));
    encoded_ = image_;
  }
  return jpeg_;
}

void ViewPainter::publish(ViewOutput& output, int quality) {
  const bool changed = std::exchange(changed_, false);
  if (!image_) return;
  if (output.image.followers == 0) {
    output.image.clear();
  } else if (changed || !output.image.newest()) {
    output.image.publish(image_);
  }
  if (output.jpeg.followers == 0) {
    output.jpeg.clear();
  } else if (changed || !output.jpeg.newest()) {
    output.jpeg.publish(jpeg(quality));
  }
}

}  // namespace phantom::synthetic_viewer
