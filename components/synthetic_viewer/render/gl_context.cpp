#include "components/synthetic_viewer/render/gl_context.hpp"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstring>
#include <vector>

#include "common/core/errors.hpp"

namespace phantom::synthetic_viewer {

namespace {

struct Candidate {
  const char* name;
  EGLDisplay display;
};

bool client_has(const char* extension) { return epoxy_has_egl_extension(EGL_NO_DISPLAY, extension); }

/// Adds the displays of graphics cards. Mesa also lists its software renderer as a device; that one is left
/// to kSurfaceless.
void add_devices(std::vector<Candidate>& candidates) {
  if (!client_has("EGL_EXT_platform_device") || !client_has("EGL_EXT_device_enumeration")) return;
  std::array<EGLDeviceEXT, 16> devices{};
  EGLint count = 0;
  if (!eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count)) return;
  for (EGLint i = 0; i < count; ++i) {
    EGLDeviceEXT device = devices[static_cast<std::size_t>(i)];
    const char* extensions = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
    if (extensions != nullptr && std::strstr(extensions, "EGL_MESA_device_software") != nullptr) continue;
    candidates.push_back({"device", eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr)});
  }
}

std::vector<Candidate> candidates_for(GraphicsPlatform platform) {
  const bool any = platform == GraphicsPlatform::kAuto;
  std::vector<Candidate> candidates;
  if (any || platform == GraphicsPlatform::kDevice) add_devices(candidates);
  if ((any || platform == GraphicsPlatform::kSurfaceless) && client_has("EGL_MESA_platform_surfaceless")) {
    candidates.push_back({"surfaceless", eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA,
                                                                  EGL_DEFAULT_DISPLAY, nullptr)});
  }
  if (any || platform == GraphicsPlatform::kDisplay) {
    candidates.push_back({"display", eglGetDisplay(EGL_DEFAULT_DISPLAY)});
  }
  return candidates;
}

/// Makes the context current. Returns an empty string, or what went wrong.
std::string make_current(EGLDisplay display, void*& context) {
  if (!epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context"))
    return "cannot work without a surface";
  if (!eglBindAPI(EGL_OPENGL_API)) return "has no desktop OpenGL";
  EGLConfig config = EGL_NO_CONFIG_KHR;
  if (!epoxy_has_egl_extension(display, "EGL_KHR_no_config_context")) {
    const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0, EGL_NONE};
    EGLint count = 0;
    if (!eglChooseConfig(display, wanted, &config, 1, &count) || count < 1)
      return "has no OpenGL configuration";
  }
  // The core profile is what EGL gives unless another is asked for.
  const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 3, EGL_NONE};
  context = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
  if (context == EGL_NO_CONTEXT) return "offers no OpenGL 3.3 core context";
  if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) return {};
  eglDestroyContext(display, context);
  return "refused to make its context current";
}

std::string text(GLenum name) {
  const GLubyte* value = glGetString(name);
  return value == nullptr ? "unknown" : reinterpret_cast<const char*>(value);
}

}  // namespace

GlContext::GlContext(GraphicsPlatform platform) {
  std::string tried;
  for (const Candidate& candidate : candidates_for(platform)) {
    // A platform's display is shared by all contexts of the process and is kept until the process ends.
    const bool there =
        candidate.display != EGL_NO_DISPLAY && eglInitialize(candidate.display, nullptr, nullptr);
    const std::string problem = there ? make_current(candidate.display, context_) : "is not there";
    if (problem.empty()) {
      display_ = candidate.display;
      description_ = text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
      return;
    }
    tried += std::string(tried.empty() ? "" : "; ") + candidate.name + " " + problem;
  }
  throw core::MissingError(
      "no OpenGL to render with: " + (tried.empty() ? "no EGL platform of that kind" : tried) +
      ". Software rendering needs the Debian packages libegl1 and libgl1-mesa-dri.");
}

GlContext::~GlContext() {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
  eglReleaseThread();
}

}  // namespace phantom::synthetic_viewer
