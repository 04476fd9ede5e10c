# SPDX-License-Identifier: Apache-2.0
# cmake -DSCRIPT=<pairs.cmake> -DWORK=<scratch folder> -P tests/pairs_test.cmake
# Runs the check of header-and-source pairs on small trees, each with one fault, and demands that it finds the fault.
cmake_policy(VERSION 3.25)

include(${CMAKE_CURRENT_LIST_DIR}/expect_fault.cmake)

set(a_h "class A final : public Base {\n  class B@\n}@\nstruct C {\n}@\n")
expect(ok src/dapple/geom/a.h "${a_h}" src/dapple/geom/a.cpp
  "namespace dapple::geom {\nconst V3f* A::f(int i) const {\n  return other::g(i)[0]@\n}\nstd::vector<Z::Y> C::C() {\n}\nA::B& A::B::operator=(const A& a) {\n}\n")
expect(ok src/dapple/geom/a.h "class Z@\n" src/dapple/geom/a.cpp "class L {\n}@\nL::L(int i) : i_(i) {}\nZ make(Z::Y y) {\n}\n")
expect(ok src/dapple/dapple.h "class Scene {\n}@\n" src/dapple/api/b.cpp "void Scene::f() {\n}\n")
expect("src/dapple/geom/b.cpp:2: defines a member of A" src/dapple/geom/a.h "${a_h}" src/dapple/geom/b.cpp "// text\nint A::f() {\n}\n")
expect("src/dapple/geom/b.cpp:1: defines a member of A" src/dapple/geom/b.h "class A::B {\n}@\n" src/dapple/geom/b.cpp "A::B::B() = default@\n")
expect("src/dapple/geom/b.cpp:1: defines a member of A" src/dapple/geom/b.h "class A@\n" src/dapple/geom/b.cpp "A::~A() {\n}\n")
expect("src/dapple/geom/b.cpp:1: defines a member of A" src/dapple/geom/b.cpp "std::map<A, std::vector<A::B>> A::table(const std::string& text) {\n}\n")
expect("src/dapple/geom/b.cpp:1: defines a member of A" src/dapple/geom/b.cpp "bool dapple::geom::A::f() {\n}\n")
expect("apps/dapple/b.cpp:2: defines a member of A" apps/dapple/b.cpp "int\nA::f() {\n}\n")
expect("No member functions" src/dapple/geom/b.cpp "int f() {\n}\n")
file(REMOVE_RECURSE ${WORK})
message("The check of pairs finds what it should.")
