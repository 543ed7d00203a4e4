#include "test/simulator/printed_page.h"

#include <cstdio>
#include <pugixml.hpp>
#include <string>

#include "test/simulator/config.h"

namespace alidade::simulator {

using Eigen::Vector2d;

namespace {

constexpr double kMillimetre = 1e-3;

Vector2d length_pair(const pugi::xml_node& node, const char* x, const char* y) {
  return kMillimetre * Vector2d(node.attribute(x).as_double(), node.attribute(y).as_double());
}

bool is_in_millimetres(const pugi::xml_node& svg) {
  const std::string width = svg.attribute("width").value();
  double box_width = 0;
  return width.size() > 2 && width.substr(width.size() - 2) == "mm" &&
         std::sscanf(svg.attribute("viewBox").value(), "0 0 %lf", &box_width) == 1 &&
         box_width == svg.attribute("width").as_double();
}

}  // namespace

PrintedPage read_printed_page(const std::filesystem::path& file) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_file(file.c_str());
  if (!parsed) throw ConfigError(file.string() + ": " + parsed.description());
  const pugi::xml_node svg = document.child("svg");
  if (!is_in_millimetres(svg))
    throw ConfigError(file.string() + ": expected an SVG page whose unit is the millimetre");
  PrintedPage page;
  page.size = length_pair(svg, "width", "height");
  for (const pugi::xml_node& group : svg.children("g")) {
    Vector2d shift = Vector2d::Zero();
    std::sscanf(group.attribute("transform").value(), "translate(%lf %lf)", &shift.x(), &shift.y());
    shift *= kMillimetre;
    for (const pugi::xml_node& shape : group.children("rect")) {
      const Vector2d corner = shift + length_pair(shape, "x", "y");
      page.rectangles.emplace_back(corner, corner + length_pair(shape, "width", "height"));
    }
    for (const pugi::xml_node& shape : group.children("circle")) {
      page.circles.push_back(
          {shift + length_pair(shape, "cx", "cy"), kMillimetre * shape.attribute("r").as_double()});
    }
  }
  if (page.rectangles.empty() && page.circles.empty())
    throw ConfigError(file.string() + ": expected rectangles or circles in a group");
  return page;
}

}  // namespace alidade::simulator
