/* The part of a page that does not depend on the scene: HTML, style, three.js with its licence, programs of
   src/scene/page. Generated when the library is built. */
#ifndef HHTDAE_SCENE_OUTPUT_PAGE_ASSETS_H
#define HHTDAE_SCENE_OUTPUT_PAGE_ASSETS_H

#include <string>

namespace hhtdae
{

std::string PageHead();  /* empty if the library was built without it */
const char *PageLacks(); /* what was missing when the library was built, such as "three.js (Debian: libjs-three)" */

} // namespace hhtdae

#endif
