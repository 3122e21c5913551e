#pragma once

#include <string>

namespace phantom::synthetic_viewer {

/// Source of the OpenGL context. None needs a display server.
enum class GraphicsPlatform {
  kAuto,         ///< the first of the three below that works
  kDevice,       ///< a graphics card, through EGL's device list
  kSurfaceless,  ///< Mesa without a surface: software rendering (llvmpipe) where there is no card
  kDisplay,      ///< EGL's default display
};

/// A headless OpenGL 3.3 core context. It is current on the thread that created it until it is destroyed;
/// only that thread may use OpenGL and destroy it. Several contexts can exist side by side.
class GlContext {
 public:
  /// Creates the context. Throws core::MissingError naming every platform that was tried and why it did not
  /// work.
  explicit GlContext(GraphicsPlatform platform = GraphicsPlatform::kAuto);
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  /// Returns driver and version, e.g. "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5".
  const std::string& description() const { return description_; }

 private:
  void *display_ = nullptr, *context_ = nullptr;  // of EGL
  std::string description_;
};

}  // namespace phantom::synthetic_viewer
