// Boost.Asio, compiled once (BOOST_ASIO_SEPARATE_COMPILATION) for all files that use it.

#include <boost/asio/impl/src.hpp>
#include <boost/asio/ssl/impl/src.hpp>
