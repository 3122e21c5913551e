#include "common/runtime/process/stop_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>

#include "common/core/errors.hpp"
#include "common/core/file_sync.hpp"
#include "common/core/random.hpp"

namespace phantom::runtime {
namespace {

constexpr std::array<char, 8> kMagic{'P', 'H', 'S', 'T', 'O', 'P', '1', '\0'};
constexpr int kMaxProcesses = 8;

std::string stem(const std::string& component, const core::NetworkOptions& network) {
  std::string name = component;
  name.append(".domain-").append(std::to_string(network.domain));
  if (!network.partition.empty()) name.append(".").append(network.partition);
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '/' || c == '\0'; }, '_');
  return name;
}

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& what) {
  throw core::MissingError(file.string() + ": " + what +
                           "; a stop must outlive the process: give a folder that can be written with "
                           "--state-dir");
}

}  // namespace

struct StopFile::Content {
  std::array<char, 8> magic;
  std::atomic<std::uint64_t> id;
  std::atomic<std::uint32_t> cause;
  std::array<char, 12> zero;
};

namespace {

std::filesystem::path numbered(const std::filesystem::path& folder, std::string name, int process) {
  if (process > 1) name.append(".").append(std::to_string(process));
  return folder / name.append(".stop");
}

bool is_fresh(const StopFile::Content& content) {
  return content.id.load() == 0 &&
         std::all_of(content.magic.begin(), content.magic.end(), [](char c) { return c == 0; });
}
bool is_damaged(const StopFile::Content& content) {
  return !is_fresh(content) && (content.magic != kMagic || content.cause.load() >= teleop::kStopCauses);
}

}  // namespace

StopFile::StopFile(const std::filesystem::path& folder, const std::string& component,
                   const core::NetworkOptions& network) {
  static_assert(sizeof(Content) == 32 && std::atomic<std::uint64_t>::is_always_lock_free);
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  const std::string name = stem(component, network);
  for (int process = 1; process <= kMaxProcesses && content_ == nullptr; ++process) {
    if (open(numbered(folder, name, process)) && process > 1)
      add_notice("another " + component + " of this cell runs on this host; stops are kept in " +
                 file_.string());
  }
  if (content_ == nullptr) refuse(numbered(folder, name, 1), "held by eight processes already");
  if (is_damaged(*content_)) {
    add_notice(file_.string() + ": damaged; taken for an emergency stop");
    write({core::random_number(), teleop::StopCause::kEmergency});
  }
  content_->magic = kMagic;
  for (int process = 1; process <= kMaxProcesses; ++process) adopt_from(numbered(folder, name, process));
  flushed_ = 0;  // the adopted stop is not on the disk yet
  if (const teleop::StopRecord kept = read(); kept.id != 0)
    add_notice(std::string("stopped since before this start (") + name_of(kept.cause) + "), until a reset");
}

// Adopts the stop from another process's file, and clears it there if no process holds that file any more.
void StopFile::adopt_from(const std::filesystem::path& file) {
  if (file == file_) return;
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor < 0) return;  // the file does not exist
  struct stat about {};
  void* mapped = fstat(descriptor, &about) == 0 && about.st_size > 0 &&
                         posix_fallocate(descriptor, 0, sizeof(Content)) == 0
                     ? mmap(nullptr, sizeof(Content), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0)
                     : MAP_FAILED;
  if (mapped != MAP_FAILED) {
    auto& other = *static_cast<Content*>(mapped);
    const bool damaged = is_damaged(other);
    const std::uint64_t id = damaged ? core::random_number() : other.id.load();
    if (id != 0 && read().id == 0)
      write(
          {id, damaged ? teleop::StopCause::kEmergency : static_cast<teleop::StopCause>(other.cause.load())});
    if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) {
      other.cause.store(0);
      other.magic = kMagic;
      other.id.store(0);
    }
    munmap(mapped, sizeof(Content));
  }
  close(descriptor);
}

void StopFile::add_notice(const std::string& sentence) {
  if (!notice_.empty()) notice_ += "; ";
  notice_ += sentence;
}

// Returns false if another process holds the file.
bool StopFile::open(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor < 0) refuse(file, std::string("cannot be opened (") + std::strerror(errno) + ")");
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    close(descriptor);
    return false;
  }
  // Reserves all the space, because a store would kill the process where the disk is full.
  if (const int error = posix_fallocate(descriptor, 0, sizeof(Content)); error != 0) {
    close(descriptor);
    refuse(file, std::string("cannot be written (") + std::strerror(error) + ")");
  }
  void* mapped =
      mmap(nullptr, sizeof(Content), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, descriptor, 0);
  if (mapped == MAP_FAILED) {
    close(descriptor);
    refuse(file, std::string("cannot be mapped (") + std::strerror(errno) + ")");
  }
  mlock(mapped, sizeof(Content));  // if permitted: a servo must not wait for a page
  if (!core::sync_folder_of(file)) {
    munmap(mapped, sizeof(Content));
    close(descriptor);
    refuse(file, std::string("cannot be brought to the disk (") + std::strerror(errno) + ")");
  }
  descriptor_ = descriptor;
  content_ = static_cast<Content*>(mapped);
  file_ = file;
  return true;
}

StopFile::~StopFile() {
  if (content_ != nullptr) munmap(content_, sizeof(Content));
  if (descriptor_ >= 0) close(descriptor_);
}

teleop::StopRecord StopFile::read() const noexcept {
  const std::uint64_t id = content_->id.load(std::memory_order_acquire);
  if (id == 0) return {};
  return {id, static_cast<teleop::StopCause>(content_->cause.load(std::memory_order_relaxed))};
}

void StopFile::write(const teleop::StopRecord& record) noexcept {
  if (record.id != 0)
    content_->cause.store(static_cast<std::uint32_t>(record.cause), std::memory_order_relaxed);
  content_->id.store(record.id, std::memory_order_release);
}

void StopFile::flush() noexcept {
  const teleop::StopId now = read().id;
  if (now != flushed_ && fdatasync(descriptor_) == 0) flushed_ = now;
}

}  // namespace phantom::runtime
