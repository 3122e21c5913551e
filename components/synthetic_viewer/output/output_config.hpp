#pragma once

#include "components/synthetic_viewer/output/recorder.hpp"

namespace phantom::synthetic_viewer {

/// How pictures leave the viewer; part of synthetic_viewer.yaml.
struct OutputConfig {
  RecordingConfig recording;
  int jpeg_quality = 80;
};

}  // namespace phantom::synthetic_viewer
