#pragma once

// The slow twin of McapReader: from the first byte to the last, one record after the other, no index, nothing
// of the library's own reading.

#include <zstd.h>

#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/recording/tests/memory_file.hpp"

namespace phantom::recording {

struct LiteralFile {
  std::vector<Sample> samples;  ///< in the order of the file
  std::map<std::uint16_t, std::string> topics;
  std::map<std::uint16_t, std::string> schema_texts;
  std::vector<std::string> metadata_names;
  bool ended = false;  ///< magic at the end
};

class LiteralReader {
 public:
  explicit LiteralReader(const Bytes& bytes) : bytes_(bytes) {}

  /// Stops where the bytes do.
  LiteralFile read() {
    std::size_t at = 8;
    while (at + 9 <= bytes_.size()) {
      const std::uint64_t length = number(bytes_, at + 1, 8);
      if (at + 9 + length > bytes_.size()) break;
      const std::uint8_t opcode = bytes_[at];
      record(opcode, Bytes(bytes_.begin() + static_cast<long>(at) + 9,
                           bytes_.begin() + static_cast<long>(at + 9 + length)));
      at += 9 + length;
      if (opcode == 0x02)
        file_.ended = bytes_.size() == at + 8 && std::memcmp(&bytes_[at], &bytes_[0], 8) == 0;
      if (opcode == 0x02 || opcode == 0x0F) in_data_ = false;
    }
    return std::move(file_);
  }

 private:
  static std::uint64_t number(const Bytes& bytes, std::size_t at, int size) {
    std::uint64_t value = 0;
    for (int i = size - 1; i >= 0; --i) value = value << 8 | bytes.at(at + static_cast<std::size_t>(i));
    return value;
  }
  static std::string text(const Bytes& bytes, std::size_t& at) {
    const std::size_t length = number(bytes, at, 4);
    const std::string found(reinterpret_cast<const char*>(bytes.data()) + at + 4, length);
    at += 4 + length;
    return found;
  }
  void record(std::uint8_t opcode, const Bytes& content) {
    std::size_t at = 0;
    if (!in_data_) return;
    if (opcode == 0x03) {
      at = 2;
      text(content, at);
      text(content, at);
      file_.schema_texts[static_cast<std::uint16_t>(number(content, 0, 2))] = text(content, at);
    } else if (opcode == 0x04) {
      at = 4;
      file_.topics[static_cast<std::uint16_t>(number(content, 0, 2))] = text(content, at);
    } else if (opcode == 0x05) {
      file_.samples.push_back({static_cast<std::uint16_t>(number(content, 0, 2)),
                               static_cast<std::uint32_t>(number(content, 2, 4)), number(content, 6, 8),
                               number(content, 14, 8), Bytes(content.begin() + 22, content.end())});
    } else if (opcode == 0x0C) {
      file_.metadata_names.push_back(text(content, at));
    } else if (opcode == 0x06) {
      chunk(content);
    }
  }
  void chunk(const Bytes& content) {
    const std::size_t size = number(content, 16, 8);
    std::size_t at = 28;
    const std::string compression = text(content, at);
    const std::size_t length = number(content, at, 8);
    const std::uint8_t* from = content.data() + at + 8;
    Bytes records(from, from + length);
    if (compression == "zstd") {
      Bytes whole(size);
      if (ZSTD_decompress(whole.data(), whole.size(), from, length) != size) throw std::runtime_error("zstd");
      records = whole;
    }
    for (std::size_t i = 0; i < records.size();) {
      const std::size_t inner = number(records, i + 1, 8);
      record(records[i], Bytes(records.begin() + static_cast<long>(i) + 9,
                               records.begin() + static_cast<long>(i + 9 + inner)));
      i += 9 + inner;
    }
  }

  const Bytes& bytes_;
  LiteralFile file_;
  bool in_data_ = true;
};

}  // namespace phantom::recording
