// The shaders of the renderer, GLSL 3.30 without the version line. See renderer.hpp for what each pass draws.
#pragma once

#include <string>

namespace palpate::shaders {

std::string plain_body_vertex();       ///< unrefined triangles
std::string curved_body_vertex();      ///< curved (PN) triangles, one instance per triangle
std::string body_fragment(int lines);  ///< an int of `Lines`: each program contains only what it draws
std::string solid_vertex();            ///< instruments and arrows
std::string solid_fragment();
std::string floor_shadow_fragment();  ///< share of key light and sky that the floor does not see, in floor coordinates
std::string floor_vertex();           ///< shadow catcher and grid
std::string floor_fragment();
std::string background_vertex();
std::string background_fragment();
std::string depth_fragment();  ///< shadow maps

}  // namespace palpate::shaders
