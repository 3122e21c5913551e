#pragma once

#include <memory>
#include <string>

namespace phantom::synthetic_viewer {

/// Where the OpenGL context comes from. None needs a display server.
enum class GraphicsPlatform {
  kAuto,         ///< the first that works of the three below
  kDevice,       ///< a graphics card, through EGL's list of devices
  kSurfaceless,  ///< Mesa without a surface: software rendering (llvmpipe) where there is no card
  kDisplay,      ///< EGL's default display
};

/// A headless OpenGL 3.3 core context, current on the thread that made it until it is destroyed. That thread
/// alone may use OpenGL and destroy it. Several may stand beside each other.
class GlContext {
 public:
  /// Throws core::MissingError naming every platform that was tried and why it did not work.
  explicit GlContext(GraphicsPlatform platform = GraphicsPlatform::kAuto);
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  /// Driver and version, e.g. "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5".
  const std::string& description() const { return description_; }

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
  std::string description_;
};

}  // namespace phantom::synthetic_viewer
