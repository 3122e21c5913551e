#pragma once

#include <string>
#include <vector>

#include "components/synthetic_viewer/image.hpp"

namespace phantom::synthetic_viewer {

/// What is written over a picture. Texts are ASCII; empty ones are left out.
struct Hud {
  std::string title;             ///< top left: which view
  std::string subtitle;          ///< below it
  bool alarm = false;            ///< red frame around the picture and a red title
  std::string banner;            ///< large, across the middle: what must not be missed; lines by '\n'
  bool gauges = false;           ///< the strip at the bottom:
  double closeness = 0.0;        ///<   bar, 0…1
  bool closeness_known = false;  ///<   false: an empty, crossed bar
  double speed_m_s = 0.0;
  std::string motion;        ///<   verdict of the unsafe-motion detector
  std::string nearest;       ///<   "forearm - work_table"
  std::string link_state;    ///<   "COUPLED"
  std::string link_quality;  ///<   "99.8 %, 1.2 ms": of slave_state that comes through, and the round trip
  std::string model_age;     ///<   "12 ms": of the pose that the picture and the percept rest on
  std::string voxel_error;   ///<   "4.3 mm": by which a surface may lie off in the voxel model
  bool recording = false;    ///< a red dot top right

  friend bool operator==(const Hud&, const Hud&) = default;
};

/// Writes on the picture. Sizes follow the picture's height. Pure.
void draw_hud(Image& image, const Hud& hud);

/// A picture of a banner alone, as wide as given: for a window, which must not wait for the next picture.
Image banner_image(const std::string& text, int width_px, bool alarm);

/// The picture as a file's content. Quality 1…100. Throws std::runtime_error if the encoder fails.
std::string encode_jpeg(const Image& image, int quality);
std::string encode_png(const Image& image);

}  // namespace phantom::synthetic_viewer
