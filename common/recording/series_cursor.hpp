#pragma once

#include <memory>
#include <vector>

#include "common/recording/recordings.hpp"

namespace phantom::recording {

/// Iterates over the messages of several recordings as if they were one: in the order of their log times;
/// messages of equal times come in the order of the recordings, then as MessageCursor orders them. So the
/// order does not depend on where the reading begins. What was carried over into a later recording is left
/// out, as it came before. Holds only the chunks that overlap in time. Not thread-safe.
class SeriesCursor {
 public:
  /// `recordings` must outlive this object. `filter.channel` sees each channel of each recording.
  explicit SeriesCursor(const std::vector<OpenedRecording>& recordings, const MessageFilter& filter = {});
  ~SeriesCursor();
  SeriesCursor(SeriesCursor&&) noexcept;
  SeriesCursor& operator=(SeriesCursor&&) noexcept;

  struct Next {
    std::size_t recording = 0;  ///< in which recording it is
    const Message* message = nullptr;
  };
  /// Returns the next message without taking it; `message` is null at the end. Valid until pop().
  Next peek();
  /// Goes on to the message after it.
  void pop();
  /// Returns what could not be read so far: chunks that are damaged.
  std::vector<std::string> problems() const;

 private:
  struct Source;
  Source* first();
  std::vector<std::unique_ptr<Source>> sources_;
};

}  // namespace phantom::recording
