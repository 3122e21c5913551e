#pragma once

#include <string>
#include <vector>

#include "components/synthetic_viewer/render/image.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"
#include "components/synthetic_viewer/state/localized_text.hpp"

namespace phantom::synthetic_viewer {

/// The head-up display: the text over a picture. Empty texts are left out; German letters that the font lacks
/// are written as it is done without them (ae).
struct Hud {
  Language language = Language::kEnglish;  ///< of the labels in the strip
  std::string title;                       ///< top left: which view
  std::string subtitle;                    ///< below it
  bool alarm = false;                      ///< red frame around the picture and a red title
  std::string banner;      ///< large, across the middle: what must not be missed; lines separated by '\n'
  bool gauges = false;     ///< the strip at the bottom:
  double closeness = 0.0;  ///<   bar, 0…1
  bool closeness_known = false;  ///<   false: an empty, crossed bar
  double speed_m_s = 0.0;
  MotionClass motion = MotionClass::kNone;  ///<   result of the unsafe-motion detector, if closeness is known
  std::string nearest;                      ///<   "forearm - work_table"
  std::string link_state;                   ///<   "COUPLED"
  std::string link_quality;  ///<   "99.8 %, 1.2 ms": share of slave_state that arrives, and the round trip
  std::string model_age;     ///<   "12 ms": age of the pose that picture and percept are based on
  std::string voxel_error;   ///<   "4.3 mm": greatest error of a surface in the voxel model
  bool recording = false;    ///< a red dot top right

  friend bool operator==(const Hud&, const Hud&) = default;
};

/// Returns the share of a picture's height that the strip of gauges covers.
double gauges_share(int height_px) noexcept;

/// Draws the HUD on the picture. Sizes scale with the picture's height. Pure.
void draw_hud(Image& image, const Hud& hud);

/// Draws a picture, a quarter as wide as `image`, into its upper right corner, with a border. Pure.
void draw_inset(Image& image, const Image& inset);

/// Returns a picture of a banner alone, of the given width. The window shows it without waiting for the next
/// picture.
Image banner_image(const std::string& text, int width_px, bool alarm);

/// Returns the picture as the content of a file. Quality 1…100. Throws std::runtime_error if the encoder
/// fails.
std::string encode_jpeg(const Image& image, int quality);
std::string encode_png(const Image& image);

}  // namespace phantom::synthetic_viewer
