// Heat through two layers in deal.II: dealii_heat FILE.msh
#include <deal.II/base/function.h>
#include <deal.II/base/quadrature_lib.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/grid/grid_in.h>
#include <deal.II/grid/tria.h>
#include <deal.II/lac/dynamic_sparsity_pattern.h>
#include <deal.II/lac/precondition.h>
#include <deal.II/lac/solver_cg.h>
#include <deal.II/lac/sparse_matrix.h>
#include <deal.II/numerics/matrix_tools.h>
#include <deal.II/numerics/vector_tools.h>

#include <fstream>
#include <iomanip>
#include <iostream>
#include <map>

using namespace dealii;

int main(int, char **argv)
{
  std::map<std::string, unsigned> names;
  {
    std::ifstream file(argv[1]);
    std::string line;
    while (std::getline(file, line) && line != "$PhysicalNames") {}
    unsigned count, dimension, tag;
    file >> count;
    for (unsigned i = 0; i < count; ++i) {
      file >> dimension >> tag >> line;
      names[line.substr(1, line.size() - 2)] = tag;
    }
  }
  Triangulation<2> mesh;
  GridIn<2> reader;
  reader.attach_triangulation(mesh);
  std::ifstream file(argv[1]);
  reader.read_msh(file);
  FE_Q<2> element(1);
  DoFHandler<2> dofs(mesh);
  dofs.distribute_dofs(element);
  DynamicSparsityPattern pattern(dofs.n_dofs());
  DoFTools::make_sparsity_pattern(dofs, pattern);
  SparsityPattern sparsity;
  sparsity.copy_from(pattern);
  SparseMatrix<double> matrix(sparsity), whole(sparsity);
  QGauss<2> points(2);
  FEValues<2> values(element, points, update_gradients | update_JxW_values);
  FullMatrix<double> local(4, 4);
  std::vector<types::global_dof_index> at(4);
  for (const auto &cell : dofs.active_cell_iterators()) {
    const double k = cell->material_id() == names["material_0"] ? 1 : cell->material_id() == names["material_1"] ? 10 : 0;
    values.reinit(cell);
    local = 0;
    for (unsigned q = 0; q < points.size(); ++q)
      for (unsigned i = 0; i < 4; ++i)
        for (unsigned j = 0; j < 4; ++j)
          local(i, j) += k * values.shape_grad(i, q) * values.shape_grad(j, q) * values.JxW(q);
    cell->get_dof_indices(at);
    matrix.add(at, local);
  }
  whole.copy_from(matrix);
  std::map<types::global_dof_index, double> held;
  VectorTools::interpolate_boundary_values(dofs, names["left"], Functions::ZeroFunction<2>(), held);
  VectorTools::interpolate_boundary_values(dofs, names["right"], Functions::ConstantFunction<2>(1.0), held);
  Vector<double> T(dofs.n_dofs()), load(dofs.n_dofs());
  MatrixTools::apply_boundary_values(held, matrix, T, load);
  SolverControl control(5000, 1e-14);
  SolverCG<> solver(control);
  solver.solve(matrix, T, load, PreconditionIdentity());
  std::cout << std::setprecision(12) << "materials by number\nborders by number\nheat "
            << whole.matrix_norm_square(T) << std::endl;
}
