#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/status.hpp"
#include "components/synthetic_viewer/render/image.hpp"
#include "components/synthetic_viewer/video/video_camera.hpp"

namespace phantom::synthetic_viewer {

/// A picture of a camera, as it came.
struct VideoPicture {
  Image image;
  std::optional<core::Nanoseconds> exposed_ns;  ///< middle of the exposure, if the source says so
  core::Nanoseconds arrived_ns = 0;             ///< CLOCK_MONOTONIC, as all times here; of a device: when the
                                                ///< kernel had it
};

/// Where pictures come from. Created, used and destroyed on one thread.
class VideoSource {
 public:
  virtual ~VideoSource() = default;
  /// Waits for the next picture, a second at most. Returns nothing if there was none, an error for a picture
  /// that is refused. Throws core::MissingError if the source is lost.
  virtual core::Expected<std::optional<VideoPicture>> next() = 0;
};

/// Greatest number of octets of a picture's file.
inline constexpr std::size_t kMaxPictureFileBytes = std::size_t{16} << 20;

/// Returns the picture that a PNG or JPEG file holds. Its size is read from its head before anything is
/// decoded. Refuses other formats, other sizes than `width_px` × `height_px`, and what does not decode as a
/// whole.
core::Expected<Image> decode_picture(std::span<const std::uint8_t> file, int width_px, int height_px);

/// Returns why a picture of this size is refused; empty if it is not.
std::string size_refusal(int width_px, int height_px, int wanted_width_px, int wanted_height_px);

/// A picture as the topic brings it, before it is decoded.
struct SentPicture {
  std::vector<std::uint8_t> jpeg;
  std::optional<core::Nanoseconds> exposed_ns;  ///< as VideoPicture
  core::Nanoseconds arrived_ns = 0;
};

/// Passes the pictures of a topic on to the thread that decodes them: the newest replaces one that waits, so
/// that at most one is held. Any thread.
class PictureInbox {
 public:
  void put(SentPicture picture);
  /// Takes down why a picture of the camera was refused.
  void refuse(std::string why);
  /// Takes down that pictures of another camera come.
  void put_foreign(const std::string& camera);
  struct News {
    std::optional<SentPicture> picture;
    std::string refusal;  ///< of the newest that was refused; empty: none was
    std::string foreign;  ///< another camera of which pictures came; empty: none did
  };
  /// Waits for a picture or a refusal, a second at most. Returns what has come since the last call.
  News take();

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  News news_;
};

/// Opens the pictures that come to `inbox`, those of the camera called `name`. `inbox` must outlive it.
std::unique_ptr<VideoSource> open_topic(const std::string& name, PictureInbox& inbox, int width_px,
                                        int height_px);

/// Lets OpenCV wait for a device's picture for a second at most, where nobody has said otherwise; by itself
/// it waits ten. To be called before any thread is started, as it sets a variable of the environment.
void bound_device_waits();

/// Opens a camera's device, video or folder of pictures; its pictures must have `width_px` × `height_px`.
/// Throws core::MissingError in words if it is not there, or is not what it must be.
std::unique_ptr<VideoSource> open_video(const VideoCamera& camera, int width_px, int height_px);

}  // namespace phantom::synthetic_viewer
