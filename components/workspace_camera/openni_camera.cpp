#include "components/workspace_camera/openni_camera.hpp"

#include <OniCAPI.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <future>
#include <mutex>
#include <span>
#include <stop_token>
#include <thread>

#include "common/core/errors.hpp"
#include "common/core/status.hpp"

namespace phantom::workspace_camera {
namespace {

constexpr int kWait_ms = 100;                                  // bounds the delay of a requested stop
constexpr core::Nanoseconds kSilence_ns = core::kNsPerSecond;  // after which a device is opened again
constexpr auto kRetry = std::chrono::seconds(1);

std::string error_of(const char* what) {
  std::string said = oniGetExtendedError();  // lines, indented
  std::ranges::replace_if(
      said, [](unsigned char c) { return std::isspace(c) != 0; }, ' ');
  const auto first = said.find_first_not_of(' '), last = said.find_last_not_of(' ');
  return first == std::string::npos ? std::string(what)
                                    : fmt::format("{}: {}", what, said.substr(first, last - first + 1));
}

/// A device with its stream of depths.
class Device {
 public:
  ~Device() {
    if (stream_ != nullptr) {
      oniStreamStop(stream_);
      oniStreamDestroy(stream_);
    }
    if (device_ != nullptr) oniDeviceClose(device_);
  }
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  core::Status open(const OpenNiOptions& options) {
    const char* const uri = options.device.empty() ? nullptr : options.device.c_str();
    if (oniDeviceOpen(uri, &device_) != ONI_STATUS_OK)
      return core::Status::invalid_argument(error_of("the device cannot be opened"));
    if (oniDeviceGetSensorInfo(device_, ONI_SENSOR_DEPTH) == nullptr)
      return core::Status::invalid_argument("the device measures no depths; allowed: a depth camera");
    if (oniDeviceCreateStream(device_, ONI_SENSOR_DEPTH, &stream_) != ONI_STATUS_OK)
      return core::Status::invalid_argument(error_of("the device gives no stream of depths"));
    ask(options);
    if (core::Status known = read_optics(options); !known) return known;
    if (oniStreamStart(stream_) != ONI_STATUS_OK)
      return core::Status::invalid_argument(error_of("the stream of depths does not start"));
    return core::Status::ok();
  }

  /// Waits for a frame. Nothing: none has come within kWait_ms.
  core::Expected<std::optional<std::vector<std::uint16_t>>> next() {
    int which = 0;
    OniStreamHandle streams[] = {stream_};
    const OniStatus waited = oniWaitForAnyStream(streams, 1, &which, kWait_ms);
    if (waited == ONI_STATUS_TIME_OUT) return std::optional<std::vector<std::uint16_t>>();
    OniFrame* frame = nullptr;
    if (waited != ONI_STATUS_OK || oniStreamReadFrame(stream_, &frame) != ONI_STATUS_OK)
      return core::Status::invalid_argument(error_of("the stream of depths has ended"));
    auto depths = depths_of(*frame);
    oniFrameRelease(frame);
    if (!depths) return depths.status();
    return std::optional(*std::move(depths));
  }
  const fusion::PinholeCamera& camera() const { return camera_; }

 private:
  /// A device that does not know an option keeps its own: its images tell.
  void ask(const OpenNiOptions& options) {
    if (!options.is_recording()) {
      for (const OniPixelFormat format : {ONI_PIXEL_FORMAT_DEPTH_1_MM, ONI_PIXEL_FORMAT_DEPTH_100_UM}) {
        const OniVideoMode mode{format, options.width_px, options.height_px, options.rate_hz};
        if (oniStreamSetProperty(stream_, ONI_STREAM_PROPERTY_VIDEO_MODE, &mode, sizeof mode) ==
            ONI_STATUS_OK)
          break;
      }
    }
    const OniBool mirrored = FALSE;
    oniStreamSetProperty(stream_, ONI_STREAM_PROPERTY_MIRRORING, &mirrored, sizeof mirrored);
    OniBool is_mirrored = FALSE;
    mirrored_ = read(ONI_STREAM_PROPERTY_MIRRORING, is_mirrored) && is_mirrored != FALSE;
  }

  template <class Value>
  bool read(int property, Value& value) {
    int size = sizeof value;
    return oniStreamGetProperty(stream_, property, &value, &size) == ONI_STATUS_OK && size == sizeof value;
  }

  /// The middle of the image is a corner of pixels, as OpenNI's own conversion has it.
  core::Status read_optics(const OpenNiOptions& options) {
    OniVideoMode mode{};
    if (!read(ONI_STREAM_PROPERTY_VIDEO_MODE, mode))
      return core::Status::invalid_argument("the device does not tell the size of its images");
    camera_.width_px = mode.resolutionX, camera_.height_px = mode.resolutionY;
    camera_.cx_px = 0.5 * camera_.width_px, camera_.cy_px = 0.5 * camera_.height_px;
    camera_.min_depth_m = options.min_depth_m, camera_.max_depth_m = options.max_depth_m;
    camera_.fx_px = camera_.fy_px = options.focal_px;
    if (options.focal_px == 0.0) {
      float across_rad = 0.0F, down_rad = 0.0F;
      const auto is_angle = [](float rad) { return rad > 0.01F && rad < 3.1F; };
      if (!read(ONI_STREAM_PROPERTY_HORIZONTAL_FOV, across_rad) || !is_angle(across_rad) ||
          !read(ONI_STREAM_PROPERTY_VERTICAL_FOV, down_rad) || !is_angle(down_rad))
        return core::Status::invalid_argument(
            "the device does not tell its field of view; allowed: openni.focal_px of the configuration");
      camera_.fx_px = 0.5 * camera_.width_px / std::tan(0.5 * static_cast<double>(across_rad));
      camera_.fy_px = 0.5 * camera_.height_px / std::tan(0.5 * static_cast<double>(down_rad));
    }
    return fusion::check_camera(camera_);
  }

  core::Expected<std::vector<std::uint16_t>> depths_of(const OniFrame& frame) const {
    const OniPixelFormat format = frame.videoMode.pixelFormat;
    if (format != ONI_PIXEL_FORMAT_DEPTH_1_MM && format != ONI_PIXEL_FORMAT_DEPTH_100_UM)
      return core::Status::invalid_argument(
          fmt::format("the frame has pixel format {}; allowed: 100 (1 mm) or 101 (100 µm)", int{format}));
    if (frame.croppingEnabled != FALSE || frame.width != camera_.width_px ||
        frame.height != camera_.height_px)
      return core::Status::invalid_argument(fmt::format(
          "the frame has {} × {} pixels{}; allowed: {} × {}, as the device tells", frame.width, frame.height,
          frame.croppingEnabled != FALSE ? ", cropped" : "", camera_.width_px, camera_.height_px));
    const auto width = static_cast<std::size_t>(frame.width), height = static_cast<std::size_t>(frame.height),
               stride = static_cast<std::size_t>(std::max(0, frame.stride)),
               row = width * sizeof(std::uint16_t);
    if (frame.data == nullptr || stride < row || frame.dataSize < 0 ||
        static_cast<std::size_t>(frame.dataSize) < (height - 1) * stride + row)
      return core::Status::invalid_argument(fmt::format(
          "the frame has {} octets in rows of {}; allowed: all of its pixels", frame.dataSize, frame.stride));
    std::vector<std::uint16_t> depth_mm(width * height);
    for (std::size_t y = 0; y < height; ++y) {
      std::uint16_t* const to = depth_mm.data() + y * width;
      std::memcpy(to, static_cast<const std::byte*>(frame.data) + y * stride, row);
      if (mirrored_) std::reverse(to, to + width);
    }
    if (format == ONI_PIXEL_FORMAT_DEPTH_100_UM)
      for (std::uint16_t& depth : depth_mm) depth = static_cast<std::uint16_t>((depth + 5) / 10);
    return depth_mm;
  }

  OniDeviceHandle device_ = nullptr;
  OniStreamHandle stream_ = nullptr;
  fusion::PinholeCamera camera_;
  bool mirrored_ = false;
};

/// Threads that take up work again and again and never end. OpenNI asks, as the system does not allow, after
/// threads that once called it: it crashes if one of them has ended.
class LastingThreads {
 public:
  static LastingThreads& all() {
    static auto* const threads = new LastingThreads;  // never ends
    return *threads;
  }
  std::future<void> run(std::function<void()> work) {
    std::packaged_task<void()> task(std::move(work));
    std::future<void> done = task.get_future();
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
    if (tasks_.size() > idle_)
      std::thread([this] { take_tasks(); }).detach();
    else
      wake_.notify_one();
    return done;
  }

 private:
  [[noreturn]] void take_tasks() {
    std::unique_lock lock(mutex_);
    for (;;) {
      ++idle_;
      wake_.wait(lock, [this] { return !tasks_.empty(); });
      --idle_;
      std::packaged_task<void()> task = std::move(tasks_.front());
      tasks_.pop_front();
      lock.unlock();
      task();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::packaged_task<void()>> tasks_;  // guarded by mutex_
  std::size_t idle_ = 0;                          // likewise
};

/// OpenNI with its drivers: loaded with the first camera, and ended with the last one.
struct Drivers {
  Drivers() {
    if (oniInitialize(ONI_API_VERSION) == ONI_STATUS_OK) return;
    const std::string why = error_of("OpenNI 2 has no driver; allowed: Debian's libopenni2-0");
    oniShutdown();  // it counts a vain call, too
    throw core::MissingError(why);
  }
  ~Drivers() { oniShutdown(); }
  Drivers(const Drivers&) = delete;
  Drivers& operator=(const Drivers&) = delete;
};

}  // namespace

struct OpenNiCamera::Impl {
  void read(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      set_trouble(read_device(stop));
      std::unique_lock lock(mutex);
      retry.wait_for(lock, stop, kRetry, [] { return false; });
    }
  }

  /// Reads until the device fails. Returns why it did.
  std::string read_device(const std::stop_token& stop) {
    Device device;
    if (const core::Status opened = device.open(options); !opened) return opened.message();
    core::Nanoseconds heard_ns = core::monotonic_ns();
    while (!stop.stop_requested()) {
      auto depths = device.next();
      const core::Nanoseconds now_ns = core::monotonic_ns();
      if (!depths) return depths.status().message();
      if (!*depths) {
        if (now_ns - heard_ns > kSilence_ns) return "the device has sent nothing for a second";
        continue;
      }
      heard_ns = now_ns;
      set_trouble("");
      {
        const std::lock_guard lock(mutex);
        newest = Image{device.camera(), now_ns, **std::move(depths)};
      }
      arrived();
    }
    return {};
  }

  void set_trouble(std::string now) {
    const std::lock_guard lock(mutex);
    trouble = std::move(now);
  }

  const OpenNiOptions options;
  const Drivers drivers;
  std::function<void()> arrived;
  mutable std::mutex mutex;
  std::condition_variable_any retry;
  std::optional<Image> newest;               // guarded by mutex
  std::string trouble = "nothing was read";  // likewise
  std::stop_source stopping;
  std::future<void> read_to_end;
};

OpenNiCamera::OpenNiCamera(OpenNiOptions options) : impl_(new Impl{std::move(options)}) {}
OpenNiCamera::~OpenNiCamera() {
  impl_->stopping.request_stop();
  if (impl_->read_to_end.valid()) impl_->read_to_end.wait();
}

void OpenNiCamera::start(std::function<void()> arrived) {
  impl_->arrived = std::move(arrived);
  impl_->read_to_end =
      LastingThreads::all().run([impl = impl_.get()] { impl->read(impl->stopping.get_token()); });
}

std::optional<OpenNiCamera::Image> OpenNiCamera::take() {
  const std::lock_guard lock(impl_->mutex);
  return std::exchange(impl_->newest, std::nullopt);
}

std::string OpenNiCamera::trouble() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->trouble;
}

}  // namespace phantom::workspace_camera
