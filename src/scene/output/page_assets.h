/* The page without a scene: HTML, style, three.js with its licence, programs of src/scene/page; made when the library is built. */
#ifndef HHTDAE_SCENE_OUTPUT_PAGE_ASSETS_H
#define HHTDAE_SCENE_OUTPUT_PAGE_ASSETS_H

#include <string>

namespace hhtdae
{

std::string PageHead();  /* empty: the library was built without it */
const char *PageLacks(); /* what was missing then, "three.js (Debian: libjs-three)" */

} // namespace hhtdae

#endif
