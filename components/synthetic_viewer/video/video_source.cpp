#include "components/synthetic_viewer/video/video_source.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "common/core/errors.hpp"
#include "common/pictures/picture_head.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr std::size_t kMaxPicturesInAFolder = 100000;
constexpr int kMaxFaultsInARow = 50;
constexpr core::Nanoseconds kDeviceSilent_ns = 5 * core::kNsPerSecond;  // then it is opened anew
constexpr core::Nanoseconds kOldestStamp_ns = core::kNsPerSecond;

core::Status no(std::string why) { return core::Status::invalid_argument(std::move(why)); }

/// Plays pictures in time: returns how long to wait for the next one, which is due then.
class Metronome {
 public:
  explicit Metronome(double rate_hz) : period_ns_(core::from_seconds(1.0 / rate_hz)) {}
  /// Sleeps until the next picture is due, a quarter of a second at most. Returns whether it is.
  bool wait() {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    const core::Nanoseconds left_ns = due_ns_ - now_ns;
    constexpr core::Nanoseconds kMax_ns = core::kNsPerSecond / 4;
    if (left_ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(std::min(left_ns, kMax_ns)));
    if (left_ns > kMax_ns) return false;
    due_ns_ = std::max(due_ns_ + period_ns_, now_ns);
    return true;
  }

 private:
  core::Nanoseconds period_ns_, due_ns_ = 0;
};

/// A folder of pictures, played in the order of their names, over and over.
class PicturesSource : public VideoSource {
 public:
  PicturesSource(const VideoCamera& camera, int width_px, int height_px)
      : width_px_(width_px), height_px_(height_px), metronome_(camera.rate_hz) {
    std::error_code problem;
    for (const auto& entry : std::filesystem::directory_iterator(camera.path, problem)) {
      const std::string ending = entry.path().extension();
      if (files_.size() < kMaxPicturesInAFolder &&
          (ending == ".png" || ending == ".jpg" || ending == ".jpeg"))
        files_.push_back(entry.path());
    }
    if (problem) throw core::MissingError(camera.path.string() + ": " + problem.message());
    if (files_.empty())
      throw core::MissingError(camera.path.string() +
                               ": has no pictures; allowed: files *.png, *.jpg, *.jpeg");
    std::ranges::sort(files_);
  }
  core::Expected<std::optional<VideoPicture>> next() override {
    if (!metronome_.wait()) return std::optional<VideoPicture>();
    const std::filesystem::path& path = files_[next_++ % files_.size()];
    const auto refused = [&](const std::string& why) { return no(path.filename().string() + " " + why); };
    std::error_code problem;
    if (!std::filesystem::is_regular_file(path, problem)) return refused("is no file");
    std::vector<std::uint8_t> octets(kMaxPictureFileBytes + 1);
    std::ifstream file(path, std::ios::binary);
    file.read(reinterpret_cast<char*>(octets.data()), static_cast<std::streamsize>(octets.size()));
    octets.resize(static_cast<std::size_t>(file.gcount()));
    if (octets.size() > kMaxPictureFileBytes) return refused("is larger than 16 MiB");
    auto image = decode_picture(octets, width_px_, height_px_);
    if (!image) return refused(image.status().message());
    return std::optional(VideoPicture{std::move(*image), std::nullopt, core::monotonic_ns()});
  }

 private:
  int width_px_, height_px_;
  Metronome metronome_;
  std::vector<std::filesystem::path> files_;
  std::size_t next_ = 0;
};

/// A V4L2 device or a video file, by OpenCV.
class CaptureSource : public VideoSource {
 public:
  CaptureSource(const VideoCamera& camera, int width_px, int height_px)
      : place_(camera.path.string()),
        device_(camera.kind == VideoKind::kDevice),
        width_px_(width_px),
        height_px_(height_px),
        metronome_(camera.rate_hz) {
    struct stat found {};
    if (stat(place_.c_str(), &found) != 0) throw core::MissingError(place_ + ": " + std::strerror(errno));
    if (device_ && !S_ISCHR(found.st_mode))
      throw core::MissingError(place_ + ": is no device; allowed: a V4L2 device such as /dev/video0");
    if (!device_ && !S_ISREG(found.st_mode)) throw core::MissingError(place_ + ": is no file");
    if (!capture_.open(place_, device_ ? cv::CAP_V4L2 : cv::CAP_ANY))
      throw core::MissingError(place_ + (device_ ? ": gives no video: it is in use, or no V4L2 camera"
                                                 : ": is no video that this system can read"));
    if (device_) {
      capture_.set(cv::CAP_PROP_FOURCC, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'));
      capture_.set(cv::CAP_PROP_FRAME_WIDTH, width_px);
      capture_.set(cv::CAP_PROP_FRAME_HEIGHT, height_px);
      capture_.set(cv::CAP_PROP_FPS, camera.rate_hz);
      capture_.set(cv::CAP_PROP_BUFFERSIZE, 1);
    }
    const double width = capture_.get(cv::CAP_PROP_FRAME_WIDTH),
                 height = capture_.get(cv::CAP_PROP_FRAME_HEIGHT);
    // Before anything is decoded.
    const std::string refusal =
        size_refusal(static_cast<int>(std::clamp(width, 0.0, 1e9)),
                     static_cast<int>(std::clamp(height, 0.0, 1e9)), width_px, height_px);
    if (!refusal.empty()) throw core::MissingError(place_ + ": " + refusal);
  }
  core::Expected<std::optional<VideoPicture>> next() override {
    if (!device_ && !metronome_.wait()) return std::optional<VideoPicture>();
    Image image;
    if (!capture_.read(image) || image.empty()) return missed();
    const core::Nanoseconds arrived_ns = last_ns_ = arrival();
    const std::string refusal = size_refusal(image.cols, image.rows, width_px_, height_px_);
    if (!refusal.empty() || image.type() != CV_8UC3)
      return no(refusal.empty() ? "it has no colours" : refusal);
    faults_ = 0;
    pictures_ = true;
    return std::optional(VideoPicture{image.clone(), std::nullopt, arrived_ns});
  }

 private:
  /// When the kernel had a device's picture, however late it was read. A time that is not of the last second
  /// is of another clock, or of a driver that tells the end of a picture in advance: then it is when it was
  /// read.
  core::Nanoseconds arrival() {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    if (!device_) return now_ns;
    const core::Nanoseconds stamp_ns = core::from_seconds(1e-3 * capture_.get(cv::CAP_PROP_POS_MSEC));
    return stamp_ns <= now_ns && now_ns - stamp_ns < kOldestStamp_ns ? stamp_ns : now_ns;
  }
  /// A device has dropped a picture or is gone; a video begins again.
  core::Expected<std::optional<VideoPicture>> missed() {
    if (device_ && access(place_.c_str(), F_OK) != 0) throw core::MissingError(place_ + ": was unplugged");
    const bool silent = device_ && core::monotonic_ns() - last_ns_ > kDeviceSilent_ns;
    if (silent || ++faults_ > kMaxFaultsInARow || (!device_ && !pictures_))
      throw core::MissingError(place_ +
                               (device_ ? ": delivers no more frames" : ": holds no picture that decodes"));
    if (!device_) {
      capture_.set(cv::CAP_PROP_POS_FRAMES, 0);
      pictures_ = false;
    }
    return std::optional<VideoPicture>();
  }

  std::string place_;
  bool device_, pictures_ = false;
  int width_px_, height_px_, faults_ = 0;
  core::Nanoseconds last_ns_ = core::monotonic_ns();  // when the last picture came, or it was opened
  Metronome metronome_;
  cv::VideoCapture capture_;
};

/// What a topic brings.
class TopicSource : public VideoSource {
 public:
  TopicSource(std::string name, PictureInbox& inbox, int width_px, int height_px)
      : name_(std::move(name)), inbox_(inbox), width_px_(width_px), height_px_(height_px) {}
  core::Expected<std::optional<VideoPicture>> next() override {
    PictureInbox::News news = inbox_.take();
    if (!news.refusal.empty() && !news.picture) return no(news.refusal);
    if (!news.picture)
      throw core::MissingError(news.foreign.empty() ? "no camera_picture comes of '" + name_ + "'"
                                                    : "camera_picture comes of '" + news.foreign +
                                                          "'; allowed: of '" + name_ + "', this camera");
    auto image = decode_picture(news.picture->jpeg, width_px_, height_px_);
    if (!image) return no("a camera_picture " + image.status().message());
    return std::optional(VideoPicture{std::move(*image), news.picture->exposed_ns, news.picture->arrived_ns});
  }

 private:
  std::string name_;
  PictureInbox& inbox_;
  int width_px_, height_px_;
};

}  // namespace

void PictureInbox::put(SentPicture picture) {
  const std::lock_guard lock(mutex_);
  news_.picture = std::move(picture);
  changed_.notify_one();
}

void PictureInbox::refuse(std::string why) {
  const std::lock_guard lock(mutex_);
  news_.refusal = std::move(why);
  changed_.notify_one();
}

void PictureInbox::put_foreign(const std::string& camera) {
  const std::lock_guard lock(mutex_);
  news_.foreign = camera;
}

PictureInbox::News PictureInbox::take() {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::seconds(1),
                    [this] { return news_.picture || !news_.refusal.empty(); });
  return std::exchange(news_, {});
}

std::unique_ptr<VideoSource> open_topic(const std::string& name, PictureInbox& inbox, int width_px,
                                        int height_px) {
  return std::make_unique<TopicSource>(name, inbox, width_px, height_px);
}

std::string size_refusal(int width_px, int height_px, int wanted_width_px, int wanted_height_px) {
  if (width_px == wanted_width_px && height_px == wanted_height_px) return {};
  return fmt::format("has {} x {} px; allowed: {} x {} px, those of its lens", width_px, height_px,
                     wanted_width_px, wanted_height_px);
}

core::Expected<Image> decode_picture(std::span<const std::uint8_t> file, int width_px, int height_px) {
  const auto head = pictures::picture_head(file);
  if (!head) return no("is neither PNG nor JPEG");
  if (const std::string refusal = size_refusal(head->width_px, head->height_px, width_px, height_px);
      !refusal.empty())
    return no(refusal);
  // OpenCV does not write to its input.
  const cv::Mat octets(1, static_cast<int>(file.size()), CV_8UC1, const_cast<std::uint8_t*>(file.data()));
  Image image;
  try {
    image = cv::imdecode(octets, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.cols != width_px || image.rows != height_px) return no("is damaged");
  return image;
}

void bound_device_waits() { setenv("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "1", 0); }

std::unique_ptr<VideoSource> open_video(const VideoCamera& camera, int width_px, int height_px) {
  if (camera.kind == VideoKind::kPictures)
    return std::make_unique<PicturesSource>(camera, width_px, height_px);
  return std::make_unique<CaptureSource>(camera, width_px, height_px);
}

}  // namespace phantom::synthetic_viewer
