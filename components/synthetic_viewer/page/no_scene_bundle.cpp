// Stands in for the bundle of web/scene in a build without the browser's scene: the page then shows the
// viewer's pictures.

#include <cstddef>

namespace phantom::synthetic_viewer::assets {

extern const unsigned char kSceneBundle[];
extern const std::size_t kSceneBundleBytes;
const unsigned char kSceneBundle[1] = {};
const std::size_t kSceneBundleBytes = 0;

}  // namespace phantom::synthetic_viewer::assets
