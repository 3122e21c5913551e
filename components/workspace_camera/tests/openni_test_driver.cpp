// An OpenNI 2 driver with devices that behave as their URIs say: phantom:still, :tenths, :mirrored, :padded,
// :without_depth, :without_optics, :cropped, :short, :unplugged. A pixel of column u measures 1 m + u mm.
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#define XN_NEW(type, ...) new type(__VA_ARGS__)
#define XN_DELETE(pointer) delete (pointer)
#include <Driver/OniDriverAPI.h>

namespace {

constexpr int kWidth_px = 320, kHeight_px = 240, kPadding = 64;
constexpr auto kPeriod = std::chrono::milliseconds(10);

template <class Value>
OniStatus give(const Value& value, void* data, int* size) {
  if (*size < static_cast<int>(sizeof value)) return ONI_STATUS_BAD_PARAMETER;
  std::memcpy(data, &value, sizeof value);
  *size = sizeof value;
  return ONI_STATUS_OK;
}

class Stream : public oni::driver::StreamBase {
 public:
  Stream(std::string kind, int opening) : kind_(std::move(kind)), opening_(opening) {}
  ~Stream() override { stop(); }

  OniStatus start() override {
    runs_ = true;
    thread_ = std::thread([this] { run(); });
    return ONI_STATUS_OK;
  }
  void stop() override {
    runs_ = false;
    if (thread_.joinable()) thread_.join();
  }
  int getRequiredFrameSize() override { return kHeight_px * stride(); }

  OniStatus getProperty(int property, void* data, int* size) override {
    if (property == ONI_STREAM_PROPERTY_VIDEO_MODE) return give(mode(), data, size);
    if (property == ONI_STREAM_PROPERTY_MIRRORING) return give(OniBool{kind_ == "mirrored"}, data, size);
    if (property == ONI_STREAM_PROPERTY_STRIDE) return give(stride(), data, size);
    if (property == ONI_STREAM_PROPERTY_CROPPING) return give(OniCropping{}, data, size);
    if (kind_ == "without_optics") return ONI_STATUS_NOT_IMPLEMENTED;
    if (property == ONI_STREAM_PROPERTY_HORIZONTAL_FOV) return give(1.0F, data, size);
    if (property == ONI_STREAM_PROPERTY_VERTICAL_FOV) return give(0.8F, data, size);
    return ONI_STATUS_NOT_IMPLEMENTED;
  }
  OniStatus setProperty(int property, const void* data, int) override {
    if (property != ONI_STREAM_PROPERTY_VIDEO_MODE) return ONI_STATUS_NOT_IMPLEMENTED;
    OniVideoMode asked;
    std::memcpy(&asked, data, sizeof asked);
    return asked.pixelFormat == mode().pixelFormat ? ONI_STATUS_OK : ONI_STATUS_NOT_SUPPORTED;
  }

 private:
  OniVideoMode mode() const {
    return {kind_ == "tenths" ? ONI_PIXEL_FORMAT_DEPTH_100_UM : ONI_PIXEL_FORMAT_DEPTH_1_MM, kWidth_px,
            kHeight_px, 30};
  }
  int stride() const { return 2 * kWidth_px + (kind_ == "padded" ? kPadding : 0); }

  void run() {
    const int frames = kind_ == "unplugged" ? 3 : 1'000'000;
    for (int i = 1; runs_; ++i) {
      if (i <= frames) send(i);
      std::this_thread::sleep_for(kPeriod);
    }
  }

  void send(int index) {
    OniFrame* const frame = getServices().acquireFrame();
    if (frame == nullptr) return;
    auto* const octets = static_cast<unsigned char*>(frame->data);
    std::memset(octets, 0xEE, static_cast<std::size_t>(frame->dataSize));
    for (int v = 0; v < kHeight_px; ++v) {
      for (int u = 0; u < kWidth_px; ++u) {
        int depth_mm = 1000 * opening_ + (kind_ == "mirrored" ? kWidth_px - 1 - u : u);
        if (v == 1) depth_mm = 1000 + index;
        const auto pixel = static_cast<std::uint16_t>(kind_ == "tenths" ? 10 * depth_mm + 4 : depth_mm);
        std::memcpy(octets + v * stride() + 2 * u, &pixel, sizeof pixel);
      }
    }
    frame->sensorType = ONI_SENSOR_DEPTH;
    frame->videoMode = mode();
    frame->frameIndex = index;
    frame->timestamp = static_cast<std::uint64_t>(index) * 33'000;
    frame->width = kWidth_px, frame->height = kHeight_px, frame->stride = stride();
    frame->cropOriginX = frame->cropOriginY = 0;
    frame->croppingEnabled = kind_ == "cropped" ? TRUE : FALSE;
    if (kind_ == "short") frame->dataSize /= 2;
    raiseNewFrame(frame);
    getServices().releaseFrame(frame);
  }

  const std::string kind_;
  const int opening_;
  std::atomic<bool> runs_{false};
  std::thread thread_;
};

class Device : public oni::driver::DeviceBase {
 public:
  Device(std::string kind, int opening) : kind_(std::move(kind)), opening_(opening) {
    modes_[0] = {ONI_PIXEL_FORMAT_DEPTH_1_MM, kWidth_px, kHeight_px, 30};
    sensor_ = {kind_ == "without_depth" ? ONI_SENSOR_COLOR : ONI_SENSOR_DEPTH, 1, modes_.data()};
  }
  OniStatus getSensorInfoList(OniSensorInfo** sensors, int* count) override {
    *sensors = &sensor_, *count = 1;
    return ONI_STATUS_OK;
  }
  oni::driver::StreamBase* createStream(OniSensorType) override { return new Stream(kind_, opening_); }
  void destroyStream(oni::driver::StreamBase* stream) override { delete stream; }

 private:
  const std::string kind_;
  const int opening_;
  std::array<OniVideoMode, 1> modes_;
  OniSensorInfo sensor_;
};

class Driver : public oni::driver::DriverBase {
 public:
  explicit Driver(OniDriverServices* services) : DriverBase(services) {}

  OniStatus initialize(oni::driver::DeviceConnectedCallback connected,
                       oni::driver::DeviceDisconnectedCallback disconnected,
                       oni::driver::DeviceStateChangedCallback changed, void* cookie) override {
    DriverBase::initialize(connected, disconnected, changed, cookie);
    return connect("phantom:still");
  }
  OniStatus tryDevice(const char* uri) override {
    return std::string(uri).starts_with("phantom:") ? connect(uri) : ONI_STATUS_ERROR;
  }
  oni::driver::DeviceBase* deviceOpen(const char* uri, const char*) override {
    const std::string kind = std::string(uri).substr(std::strlen("phantom:"));
    const std::lock_guard lock(mutex_);
    return new Device(kind, ++openings_[kind]);
  }
  void deviceClose(oni::driver::DeviceBase* device) override { delete device; }
  void shutdown() override {}

 private:
  OniStatus connect(const std::string& uri) {
    OniDeviceInfo info{};
    std::strncpy(info.uri, uri.c_str(), sizeof info.uri - 1);
    std::strncpy(info.vendor, "Phantom", sizeof info.vendor - 1);
    deviceConnected(&info);
    return ONI_STATUS_OK;
  }
  std::mutex mutex_;
  std::map<std::string, int> openings_;  // guarded by mutex_
};

}  // namespace

ONI_EXPORT_DRIVER(Driver)
