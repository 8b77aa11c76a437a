/*
  The XDMF file: the light XML that tells ParaView what the arrays of fields.h5 mean.

  One temporal collection; each step is a spatial collection of the meshes that have a field and of the spheres.
  XDMF lists axes slowest first, so sizes, origin and spacing stand in the order x3, x2, x1.
*/
#include "private/dlmfieldsio.h"
#include <errno.h>
#include <stdio.h>

_Static_assert(sizeof(PetscReal) == 8, "fields.xmf says 8-byte numbers");
#define H5_FLOAT "NumberType=\"Float\" Precision=\"8\" Format=\"HDF\""

static const char *AttributeType(PetscInt dof)
{
  return dof == 1 ? "Scalar" : dof == 3 ? "Vector" : "Tensor6";
}

static void WriteGrid(FILE *out, const DLMFieldStep *step, const DLMFieldMesh *mesh, PetscInt mesh_index)
{
  int n[3];

  for (int i = 0; i < 3; i++) n[i] = (int)(mesh->nodes[i] + mesh->periodic[i]);
  fprintf(out, "        <Grid Name=\"%s\">\n", mesh->name);
  fprintf(out, "          <Topology TopologyType=\"3DCoRectMesh\" Dimensions=\"%d %d %d\"/>\n", n[2], n[1],
          n[0]);
  fprintf(out, "          <Geometry GeometryType=\"ORIGIN_DXDYDZ\">\n");
  for (int i = 0; i < 2; i++) {
    const PetscReal *a = i ? mesh->spacing : mesh->origin;
    fprintf(out,
            "            <DataItem Name=\"%s\" Dimensions=\"3\" NumberType=\"Float\" Precision=\"8\" "
            "Format=\"XML\">",
            i ? "Spacing" : "Origin");
    fprintf(out, "%.17g %.17g %.17g</DataItem>\n", (double)a[2], (double)a[1], (double)a[0]);
  }
  fprintf(out, "          </Geometry>\n");
  for (PetscInt f = 0; f < step->n_fields; f++) {
    const DLMFieldEntry *field = &step->fields[f];
    if (field->mesh != mesh_index) continue;
    fprintf(out, "          <Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"Node\">\n", field->name,
            AttributeType(field->dof));
    fprintf(out, "            <DataItem Dimensions=\"%d %d %d", n[2], n[1], n[0]);
    if (field->dof > 1) fprintf(out, " %d", (int)field->dof);
    fprintf(out, "\" " H5_FLOAT ">fields.h5:/" DLM_STEP_NAME "/%s</DataItem>\n", step->step, field->name);
    fprintf(out, "          </Attribute>\n");
  }
  fprintf(out, "        </Grid>\n");
}

static void WriteSphereAttribute(FILE *out, const DLMFieldStep *step, const char *name, int dof)
{
  fprintf(out, "          <Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"Node\">\n", name,
          AttributeType(dof));
  fprintf(out, "            <DataItem Dimensions=\"%d%s\" " H5_FLOAT ">", (int)step->n_spheres,
          dof == 3 ? " 3" : "");
  fprintf(out, "fields.h5:/" DLM_STEP_NAME "/spheres/%s</DataItem>\n", step->step, name);
  fprintf(out, "          </Attribute>\n");
}

/* Points with the spheres' numbers as connectivity: ParaView's XDMF 3 reader does not count for itself. */
static void WriteSpheres(FILE *out, const DLMFieldStep *step)
{
  int n = (int)step->n_spheres;

  fprintf(out, "        <Grid Name=\"spheres\">\n");
  fprintf(out,
          "          <Topology TopologyType=\"Polyvertex\" NumberOfElements=\"%d\" NodesPerElement=\"1\">\n",
          n);
  fprintf(out, "            <DataItem Dimensions=\"%d\" NumberType=\"Int\" Precision=\"4\" Format=\"HDF\">", n);
  fprintf(out, "fields.h5:/" DLM_STEP_NAME "/spheres/id</DataItem>\n", step->step);
  fprintf(out, "          </Topology>\n");
  fprintf(out, "          <Geometry GeometryType=\"XYZ\">\n");
  fprintf(out, "            <DataItem Dimensions=\"%d 3\" " H5_FLOAT ">", n);
  fprintf(out, "fields.h5:/" DLM_STEP_NAME "/spheres/center</DataItem>\n", step->step);
  fprintf(out, "          </Geometry>\n");
  WriteSphereAttribute(out, step, "radius", 1);
  WriteSphereAttribute(out, step, "velocity", 3);
  WriteSphereAttribute(out, step, "omega", 3);
  fprintf(out, "        </Grid>\n");
}

static void WriteStep(FILE *out, DLMFieldFile file, const DLMFieldStep *step)
{
  fprintf(out, "      <Grid Name=\"" DLM_STEP_NAME "\" GridType=\"Collection\" CollectionType=\"Spatial\">\n",
          step->step);
  fprintf(out, "        <Time Value=\"%.17g\"/>\n", (double)step->time);
  for (PetscInt m = 0; m < file->n_meshes; m++) {
    PetscInt used = 0;
    for (PetscInt f = 0; f < step->n_fields; f++) used += step->fields[f].mesh == m;
    if (used) WriteGrid(out, step, &file->meshes[m], m);
  }
  if (step->n_spheres) WriteSpheres(out, step);
  fprintf(out, "      </Grid>\n");
}

PetscErrorCode DLMFieldFileWriteXdmf(DLMFieldFile file)
{
  char  temporary[PETSC_MAX_PATH_LEN + 8];
  FILE *out;
  int   failed;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(temporary, sizeof(temporary), "%s.tmp", file->xmf_path));
  out = fopen(temporary, "w");
  PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "Cannot write %s: %s", temporary, strerror(errno));
  fprintf(out, "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n");
  fprintf(out, "    <Grid Name=\"dlmfd\" GridType=\"Collection\" CollectionType=\"Temporal\">\n");
  for (PetscInt s = 0; s < file->n_steps; s++) WriteStep(out, file, &file->steps[s]);
  fprintf(out, "    </Grid>\n  </Domain>\n</Xdmf>\n");
  failed = ferror(out);
  failed = fclose(out) || failed;
  PetscCheck(!failed, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "Cannot write %s: %s", temporary, strerror(errno));
  PetscCheck(!rename(temporary, file->xmf_path), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE,
             "Cannot rename %s to %s: %s", temporary, file->xmf_path, strerror(errno));
  PetscFunctionReturn(0);
}
