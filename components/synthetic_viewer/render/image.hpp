#pragma once

#include <opencv2/core/mat.hpp>

namespace phantom::synthetic_viewer {

/// A picture: CV_8UC3, blue, green, red, without padding. Copies share their pixels.
using Image = cv::Mat;

}  // namespace phantom::synthetic_viewer
