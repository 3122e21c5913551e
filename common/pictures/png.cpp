#include "common/pictures/png.hpp"

#include <png.h>

#include <cstring>
#include <stdexcept>
#include <string>

namespace phantom::pictures {

std::vector<std::uint8_t> encode_png(const std::uint8_t* bgr, int width, int height, std::size_t stride) {
  if (width <= 0 || height <= 0) throw std::runtime_error("a picture without pixels cannot be a PNG file");
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_BGR;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::uint8_t> bytes(size);
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, bgr, static_cast<png_int_32>(stride),
                                nullptr) == 0)
    throw std::runtime_error(std::string("PNG: ") + image.message);
  bytes.resize(size);
  return bytes;
}

}  // namespace phantom::pictures
